import { Alert, Anchor, Loader, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useState } from "react";

import { type SweepInfo, sweeps } from "../api/sweeps";
import { go, hashOf } from "../ui/address";
import { tell, tellError } from "../ui/notices";
import { CaseTable } from "./CaseTable";
import { ExperimentHead } from "./ExperimentHead";
import { Parallel } from "./Parallel";
import { lasting } from "./plan";
import { Plane } from "./Plane";
import { useSweep } from "./useSweep";
import "./experiments.css";

/** One sweep: how far it is, the boundary between safe and not, and its cases. */
export function SweepView({ scenario, sweep }: { scenario: string; sweep: string }) {
  const { info, cases, error, reload } = useSweep(sweep);
  const [opening, setOpening] = useState(false);
  const open = (name: string): void => {
    if (opening) return;
    setOpening(true);
    sweeps.open(sweep, name).then(
      (saved) => {
        tell(t`${name} is saved as the scenario ${saved.name}. Run it: its figures are those of the sweep.`);
        go({ view: "editor", scenario: saved.name });
      },
      (reason: unknown) => {
        setOpening(false);
        tellError(reason);
      },
    );
  };
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="xs">
        <Trans>Sweep {sweep}</Trans>
      </Title>
      {error && (
        <Alert color="red" title={t`The sweep cannot be shown`}>
          {error}
        </Alert>
      )}
      {!info && !error && <Loader aria-label={t`Loading the sweep`} />}
      {info && <Head scenario={scenario} info={info} onChanged={reload} />}
      {info && info.state !== "running" && !cases && !error && <Loader aria-label={t`Loading the cases`} />}
      {cases && (
        <>
          <Plane table={cases} onOpen={open} />
          <Parallel table={cases} onOpen={open} />
          <Title order={2} size="h4" mt="lg" mb="xs">
            <Trans>Cases</Trans>
          </Title>
          <Text size="sm" mb="xs">
            <Trans>
              Safe: {cases.limits.join("; ")}. A click on a case opens it in the editor as a scenario of its
              own, which runs alone with the same figures.
            </Trans>
          </Text>
          <CaseTable table={cases} onOpen={open} />
        </>
      )}
    </div>
  );
}

/** Outcome or progress, and what can be done. */
function Head({ scenario, info, onChanged }: { scenario: string; info: SweepInfo; onChanged: () => void }) {
  const { sweep, state, cases, ended, seconds_left: left, safe, unsafe, error } = info;
  return (
    <ExperimentHead
      name={sweep}
      state={state}
      share={(100 * ended) / cases}
      error={error}
      words={{
        progress: t`Cases that have ended`,
        failed: t`The sweep has failed`,
        remove: t`Delete the sweep`,
        all: t`All sweeps`,
      }}
      actions={{
        stop: () => sweeps.stop(sweep),
        resume: () => sweeps.resume(sweep, 2),
        remove: () => sweeps.remove(sweep),
      }}
      links={
        state === "done" && (
          <>
            <Anchor href={sweeps.fileUrl(sweep, "sweep.html")} target="_blank" rel="noreferrer">
              <Trans>Download as HTML</Trans>
            </Anchor>
            <Anchor href={sweeps.fileUrl(sweep, "cases.parquet")}>
              <Trans>Table as Parquet</Trans>
            </Anchor>
          </>
        )
      }
      all={hashOf({ view: "sweeps", scenario })}
      lost={
        <Trans>
          Its <Plural value={ended} one="# run" other="# runs" /> are deleted for good. Scenarios that were
          made of its cases stay.
        </Trans>
      }
      onChanged={onChanged}
      onRemoved={() => go({ view: "sweeps", scenario })}
    >
      <Trans>
        <Plural value={cases} one="# case" other="# cases" /> of {info.parameters.join(", ")}
      </Trans>
      {state === "done" && t`: ${safe ?? 0} safe, ${unsafe ?? 0} not`}
      {state === "done" &&
        (safe ?? 0) + (unsafe ?? 0) < cases &&
        t`, ${cases - (safe ?? 0) - (unsafe ?? 0)} not run`}
      {state !== "done" && t`: ${ended} have ended`}
      {state === "running" && left !== null && t`, about ${lasting(left)} left`}
      {state === "stopped" && t`. It was stopped; what is missing can be run at any time`}.
    </ExperimentHead>
  );
}
