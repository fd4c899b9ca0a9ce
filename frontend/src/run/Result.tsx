import { Alert, Button, Group, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { served } from "../language/served";
import { localized } from "../language/localized";
import { carla } from "../api/carla";
import { allFigures } from "../api/figures";
import { type RunInfo, runs, type RunWish, type Summary, type Verdict } from "../api/runs";
import { driverWords } from "../ui/drivers";
import { verdictWord } from "../ui/words";
import { tellError } from "../ui/notices";
import { go } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { Comparison } from "./Comparison";
import { Criteria } from "./Criteria";
import { Egos } from "./Egos";
import { keyFigures } from "./figures";
import { Files } from "./Files";
import { Interrupted, SliceTable } from "./LongRun";

/** Longer runs are not watched in real time. */
const LONG = 3600;
const TITLE = localized((): Record<string, string> => ({
  failed: t`The run failed`,
  stopped: t`The run was stopped`,
}));

/** The result of a run, in figures. */
export function Result({
  info,
  scenario,
  onBack,
  onResume,
  onShow,
}: {
  info: RunInfo;
  scenario: string;
  onBack: () => void;
  onResume: () => void;
  /** Shows a second of the run in its recording; null without one. */
  onShow: ((time: number) => void) | null;
}) {
  const [busy, setBusy] = useState(false);
  const known = useLoaded(allFigures);
  const again = (): void => {
    setBusy(true);
    const driver = info.summary?.behaviour;
    const wish: RunWish = {
      scenario,
      speed: Number(info.summary?.until) > LONG ? null : 1,
      ...(driver && { behaviour: { name: driver, options: info.summary?.behaviour_options } }),
    };
    runs.start(wish).then(
      ({ run }) => go({ view: "run", scenario, run }),
      (error: unknown) => {
        setBusy(false);
        tellError(error);
      },
    );
  };
  if (info.state === "interrupted") return <Interrupted info={info} onBack={onBack} onResume={onResume} />;
  const failed = info.state === "failed";
  const verdict = failed ? null : (info.summary?.usable ?? null);
  return (
    <section aria-label={t`Result of the run`}>
      <Title order={2} size="h3">
        {TITLE()[info.state] ?? t`Run finished`}
        {verdict &&
          `: ${info.summary && isJudged(info.summary) ? passed(info.summary) : verdictWord(verdict.level)}`}
      </Title>
      {info.summary?.behaviour && (
        <Text size="sm" c="dimmed">
          <Trans>Controlled by: {driverWords(info.summary.behaviour)}</Trans>
        </Text>
      )}
      {verdict && <Reservations verdict={verdict} />}
      {failed && <Failure info={info} />}
      {info.summary && <Criteria criteria={info.summary.criteria} onShow={failed ? null : onShow} />}
      {info.summary && !failed && <Egos run={info.run} />}
      {info.summary && !failed && (
        <dl className="run-figures">
          {keyFigures(info.summary, known.value ?? []).map(({ name, label, definition, value }) => (
            <div key={name} title={definition}>
              <dt>{label}</dt>
              <dd>{value}</dd>
            </div>
          ))}
        </dl>
      )}
      <Group mt="md" mb="lg" gap="xs">
        <Button onClick={onBack}>
          <Trans>Back to the editor</Trans>
        </Button>
        {info.summary && !failed && (
          <Button
            variant="default"
            component="a"
            href={runs.reportUrl(info.run)}
            target="_blank"
            rel="noreferrer"
          >
            <Trans>Full report</Trans>
          </Button>
        )}
        {compared(info.summary) && (
          <Button
            variant="default"
            component="a"
            href={carla.comparisonUrl(info.run)}
            target="_blank"
            rel="noreferrer"
          >
            <Trans>Compared with CARLA</Trans>
          </Button>
        )}
        <Button variant="default" loading={busy} onClick={again}>
          <Trans>Run again</Trans>
        </Button>
      </Group>
      {info.summary && !failed && <SliceTable summary={info.summary} />}
      {info.summary && !failed && <Comparison info={info} scenario={scenario} />}
      {info.summary && !failed && <Files run={info.run} />}
    </section>
  );
}

/** Whether a run is a scene that says itself when it has passed. */
const isJudged = (summary: Summary): boolean => summary.scene && summary.criteria.length > 0;

const passed = (summary: Summary): string =>
  summary.usable?.level !== "not usable" && summary.criteria.every((one) => one.passed)
    ? t`passed`
    : t`not passed`;

/** Why the figures below cannot be used, or only with care; nothing of a usable run. */
function Reservations({ verdict }: { verdict: Verdict }) {
  if (verdict.reasons.length === 0) return null;
  const bad = verdict.level === "not usable";
  return (
    <Alert
      color={bad ? "red" : "yellow"}
      mt="sm"
      title={bad ? t`The figures of this run cannot be used` : t`Use these figures with care`}
    >
      <ul className="verdict-reasons">
        {verdict.reasons.map(({ kind, words }) => (
          <li key={kind}>{served(words)}</li>
        ))}
      </ul>
    </Alert>
  );
}

const compared = (summary: Summary | null): boolean => summary !== null && "parity" in summary.files;

function Failure({ info }: { info: RunInfo }) {
  const words = info.error;
  return (
    <>
      <Alert color="red" mt="sm" title={t`The simulation could not continue`}>
        <Trans>
          Your scenario is unchanged, and other runs continue.{" "}
          {info.carla
            ? t`See below what is wrong with CARLA, or run without it.`
            : t`Try to run it again; if it fails at the same time, remove the road users that were inserted last.`}
        </Trans>
      </Alert>
      <details className="words" style={{ marginTop: 12 }}>
        <summary>
          <Trans>Messages of the simulator</Trans>
        </summary>
        {words ? (
          <pre tabIndex={0}>{served(words)}</pre>
        ) : (
          <Text size="sm">
            <Trans>There are none.</Trans>
          </Text>
        )}
      </details>
    </>
  );
}
