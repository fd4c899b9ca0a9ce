import { Alert, Button, Group, Text, Title } from "@mantine/core";
import { useState } from "react";

import { carla } from "../api/carla";
import { allFigures } from "../api/figures";
import { type RunInfo, runs, type Summary } from "../api/runs";
import { tellError } from "../ui/notices";
import { go } from "../ui/route";
import { useLoaded } from "../ui/useLoaded";
import { Comparison } from "./Comparison";
import { keyFigures } from "./figures";
import { Files } from "./Files";
import { Interrupted, SliceTable } from "./LongRun";

/** Nobody watches a longer run in real time. */
const LONG = 3600;
const TITLE: Record<string, string> = { failed: "The run broke off", stopped: "The run was stopped" };

/** What came of a run, in figures. */
export function Result({ info, scenario, onBack, onGoOn }: {
  info: RunInfo; scenario: string; onBack: () => void; onGoOn: () => void;
}) {
  const [busy, setBusy] = useState(false);
  const known = useLoaded(allFigures);
  const again = (): void => {
    setBusy(true);
    runs.start({ scenario, speed: Number(info.summary?.until) > LONG ? null : 1 }).then(
      ({ run }) => go({ view: "run", scenario, run }),
      (error: unknown) => { setBusy(false); tellError(error); });
  };
  if (info.state === "interrupted") return <Interrupted info={info} onBack={onBack} onGoOn={onGoOn} />;
  const failed = info.state === "failed";
  return (
    <section aria-label="Result of the run">
      <Title order={2} size="h3">{TITLE[info.state] ?? "The run is finished"}</Title>
      {failed && <Failure info={info} />}
      {info.summary && !failed && (
        <dl className="run-figures">
          {keyFigures(info.summary, known.value ?? []).map(({ name, label, definition, value }) => <div key={name} title={definition}><dt>{label}</dt><dd>{value}</dd></div>)}
        </dl>
      )}
      <Group mt="md" mb="lg" gap="xs">
        <Button onClick={onBack}>Back to the editor</Button>
        {info.summary && !failed && <Button variant="default" component="a" href={runs.reportUrl(info.run)} target="_blank" rel="noreferrer">Full report</Button>}
        {compared(info.summary) && <Button variant="default" component="a" href={carla.comparisonUrl(info.run)} target="_blank" rel="noreferrer">Compared with CARLA</Button>}
        <Button variant="default" loading={busy} onClick={again}>Run again</Button>
      </Group>
      {info.summary && !failed && <SliceTable summary={info.summary} />}
      {info.summary && !failed && <Comparison info={info} scenario={scenario} />}
      {info.summary && !failed && <Files run={info.run} />}
    </section>
  );
}

const compared = (summary: Summary | null): boolean => summary !== null && "parity" in summary.files;

function Failure({ info }: { info: RunInfo }) {
  const words = info.error;
  return (
    <>
      <Alert color="red" mt="sm" title="The simulation could not go on">
        Your scenario is as it was, and other runs go on. {info.carla
          ? "See below what is wrong with CARLA, or run it without."
          : "Try to run it again; if it breaks off at the same time, remove the road users that came last."}
      </Alert>
      <details className="words" style={{ marginTop: 12 }}>
        <summary>What the simulator said</summary>
        {words ? <pre tabIndex={0}>{words}</pre> : <Text size="sm">It said nothing.</Text>}
      </details>
    </>
  );
}
