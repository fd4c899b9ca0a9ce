import { i18n } from "@lingui/core";
import { Text, Title } from "@mantine/core";

import { plural, t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import type { ImportReport, ImportRow } from "../api/exchange";
import { IconTarget } from "../ui/icons";
import {
  type Element,
  grouped,
  kinds,
  MEANING,
  type Reason,
  spotOf,
  TITLES,
  type Verdict,
  VERDICTS,
} from "./report";

/** Elements named of one reason; the rest are counted. */
const NAMED = 60;

interface Chosen {
  chosen: ImportRow | null;
  /** Shows a place on the map. */
  onPlace: (row: ImportRow) => void;
}

/** What became of a file: how much of it first, then what was not taken as it is, refused first. */
export function ReportPanel({ report, ...chosen }: { report: ImportReport } & Chosen) {
  const all = VERDICTS.reduce((sum, verdict) => sum + report[verdict].length, 0);
  const share = all > 0 ? Math.floor((100 * report.taken.length) / all) : 0;
  return (
    <>
      <Text>
        {report.refused.length === 0
          ? t`Everything that acts was imported.`
          : plural(report.refused.length, {
              one: "# element could not be imported.",
              other: "# elements could not be imported.",
            })}{" "}
        <Trans>
          Of <Plural value={all} one="# element" other="# elements" /> in the file, {share} % were imported
          unchanged.
        </Trans>
      </Text>
      <dl className="import-counts">
        {VERDICTS.map((verdict) => (
          <div key={verdict} data-verdict={verdict}>
            <dt>{TITLES()[verdict]}</dt>
            <dd>{report[verdict].length.toLocaleString(i18n.locale)}</dd>
          </div>
        ))}
      </dl>
      {VERDICTS.filter((verdict) => report[verdict].length > 0).map((verdict) => (
        <section key={verdict} aria-label={TITLES()[verdict]}>
          <Title order={2} size="h5" mt="lg">
            {TITLES()[verdict]}
          </Title>
          {verdict === "taken" ? (
            <Taken rows={report.taken} />
          ) : (
            <List verdict={verdict} rows={report[verdict]} file={report.file} {...chosen} />
          )}
        </section>
      ))}
    </>
  );
}

function List({
  verdict,
  rows,
  ...rest
}: { verdict: Verdict; rows: readonly ImportRow[]; file: string } & Chosen) {
  return (
    <>
      <Text size="sm" c="dimmed" mb={6}>
        {MEANING()[verdict]}
      </Text>
      <ul className="import-reasons">
        {grouped(rows).map((reason) => (
          <li key={reason.text}>
            <Text size="sm">{reason.text}</Text>
            <Elements reason={reason} {...rest} />
          </li>
        ))}
      </ul>
    </>
  );
}

function Elements({ reason: { elements }, ...rest }: { reason: Reason; file: string } & Chosen) {
  return (
    <ul className="import-elements">
      {elements.slice(0, NAMED).map((element) => (
        <li key={`${element.row.file} ${element.row.xpath}`}>
          <Where element={element} {...rest} />
        </li>
      ))}
      {elements.length > NAMED && (
        <li>
          <Trans>
            and <Plural value={elements.length - NAMED} one="# more" other="# more" />
          </Trans>
        </li>
      )}
    </ul>
  );
}

/** An element with its line; a button if it has a place on the map. */
function Where({
  element: { row, word, inside },
  file,
  chosen,
  onPlace,
}: { element: Element; file: string } & Chosen) {
  const line = row.file === file ? t`line ${row.line}` : t`line ${row.line} of ${row.file}`;
  const words = (
    <>
      {word}, {line}
      {inside > 0 && (
        <span className="import-inside">
          {" "}
          <Trans>
            with <Plural value={inside} one="# part" other="# parts" />
          </Trans>
        </span>
      )}
    </>
  );
  if (!spotOf(row)) return <span title={row.xpath}>{words}</span>;
  return (
    <button
      type="button"
      className="import-place"
      title={row.xpath}
      aria-label={t`${word}, ${line}: show on the map`}
      aria-pressed={chosen === row}
      onClick={() => onPlace(row)}
    >
      <IconTarget size={14} />
      <span>{words}</span>
    </button>
  );
}

function Taken({ rows }: { rows: readonly ImportRow[] }) {
  return (
    <details>
      <summary className="import-summary">
        <Trans>
          <Plural value={rows.length} one="# element" other="# elements" />, by kind
        </Trans>
      </summary>
      <ul className="import-elements">
        {kinds(rows).map(([word, number]) => (
          <li key={word}>
            {word}: {number.toLocaleString(i18n.locale)}
          </li>
        ))}
      </ul>
    </details>
  );
}
