import { i18n } from "@lingui/core";
import { Alert, Anchor, Loader, Modal, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { conversionReport, reportUrl } from "../api/maps";
import { useLoaded } from "../ui/useLoaded";
import { coverage, type Finding, type Group, grouped } from "./conversion";

/** Places named in the list; the rest are in the file. */
const NAMED = 40;

/** The import report of a map. */
export function Conversion({ map, onClose }: { map: string; onClose: () => void }) {
  return (
    <Modal opened onClose={onClose} size="lg" title={t`Import report of ${map}`}>
      <Body map={map} />
    </Modal>
  );
}

function Body({ map }: { map: string }) {
  const { value, error } = useLoaded(useCallback(() => conversionReport(map), [map]));
  if (error)
    return (
      <Alert color="red" title={t`The report cannot be shown`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Loading the report`} />;
  const { driving, walking } = coverage(value);
  return (
    <>
      {driving !== null && (
        <Text>
          <Trans>
            <b>{driving} %</b> of the lanes can be driven on in the simulation.
          </Trans>
        </Text>
      )}
      {walking !== null && (
        <Text>
          <Trans>
            <b>{walking} %</b> of the footways can be walked on.
          </Trans>
        </Text>
      )}
      {grouped(value).map((group) => (
        <Section key={group.outcome} group={group} />
      ))}
      <Anchor href={reportUrl(map)} target="_blank" rel="noreferrer" size="sm">
        <Trans>Everything in detail, for experts (JSON)</Trans>
      </Anchor>
    </>
  );
}

function Section({ group }: { group: Group }) {
  return (
    <section aria-label={group.title}>
      <Title order={3} size="h5" mt="lg">
        {group.title}
      </Title>
      <ul style={{ margin: "6px 0 14px", paddingLeft: 20 }}>
        {group.findings.map((finding) => (
          <li key={finding.text} style={{ marginBottom: 6 }}>
            <Found finding={finding} />
          </li>
        ))}
      </ul>
    </section>
  );
}

function Found({ finding: { text, places } }: { finding: Finding }) {
  if (places.length === 1)
    return (
      <>
        {text}{" "}
        <Text span size="sm" c="dimmed">
          ({places[0]})
        </Text>
      </>
    );
  return (
    <>
      {text}
      <details>
        <summary style={{ cursor: "pointer", fontSize: 13 }}>
          <Trans>{places.length.toLocaleString(i18n.locale)} places</Trans>
        </summary>
        <Text size="sm" c="dimmed">
          {places.slice(0, NAMED).join("; ")}
          {places.length > NAMED && t` and ${places.length - NAMED} more`}
        </Text>
      </details>
    </>
  );
}
