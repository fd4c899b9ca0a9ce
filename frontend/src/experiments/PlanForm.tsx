import { Alert, Button, Group, NumberInput, Select, TagsInput, Text, Textarea } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useEffect, useMemo, useRef, useState } from "react";

import { fixed } from "../language/numbers";
import { served } from "../language/served";
import { allFigures, installedFigures } from "../api/figures";
import { type PlannedSweep, sweeps } from "../api/sweeps";
import type { ScenarioDocument } from "../api/types";
import { shortNumber } from "../editor/parameters";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { useLoaded } from "../ui/useLoaded";
import { bytes } from "../ui/words";
import { countOf, faultOf, lasting, METHODS, newForm, type SweepForm, tableOf, wishOf } from "./plan";
import { VariedRow } from "./VariedRow";

/** What is varied and how; says what it takes before it starts. */
export function PlanForm({ scenario, document }: { scenario: string; document: ScenarioDocument }) {
  const [form, setForm] = useState(() => newForm(document));
  const [planned, setPlanned] = useState<PlannedSweep | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const [busy, setBusy] = useState<"plan" | "start" | null>(null);
  const figures = useLoaded(allFigures).value;
  const installed = useLoaded(installedFigures).value;
  const set = (fields: Partial<SweepForm>): void => {
    setForm({ ...form, ...fields });
    setPlanned(null); // which is of another sweep now
    setFailure(null);
  };
  const answer = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (planned) answer.current?.scrollIntoView({ block: "nearest" });
  }, [planned]);
  const fault = faultOf(form);
  const cases = countOf(form);
  const wish = useMemo(() => wishOf(scenario, form), [scenario, form]);
  const newest = useRef(wish);
  newest.current = wish;
  const failed = (error: unknown): void => {
    setFailure(reasonOf(error));
    setBusy(null);
  };
  const plan = (): void => {
    setBusy("plan");
    setFailure(null);
    // One case runs for the answer; if the form has changed meanwhile, that is about another sweep.
    sweeps.plan(wish).then(
      (found) => {
        if (newest.current === wish) setPlanned(found);
        setBusy(null);
      },
      (error: unknown) => {
        if (newest.current === wish) failed(error);
        else setBusy(null);
      },
    );
  };
  const start = (): void => {
    setBusy("start");
    sweeps.start(wish).then(({ sweep }) => go({ view: "sweep", scenario, sweep }), failed);
  };
  const grid = form.method === "grid";
  const parameters = Object.entries(document.parameters);
  const free = parameters.filter(([name]) => document.formulas[`parameters/${name}/value`] === undefined);
  const together = tableOf(form.table, Object.keys(form.varied)).names;
  return (
    <div className="plan-form">
      {parameters.map(([name, { value, unit, description }]) => (
        <VariedRow
          key={name}
          name={name}
          unit={unit}
          value={value}
          description={description}
          computed={document.formulas[`parameters/${name}/value`]}
          grid={grid}
          inTable={together.includes(name)}
          varied={form.varied[name]}
          onVaried={(one) => set({ varied: { ...form.varied, [name]: one } })}
        />
      ))}
      {free.length > 1 && (
        <Textarea
          label={t`Table of values that belong together`}
          description={t`Names of parameters in the first line, below them their values, one row after the other: ${unitsOf(free)}`}
          placeholder={exampleOf(free)}
          autosize
          minRows={2}
          maxRows={12}
          spellCheck={false}
          value={form.table}
          onChange={(event) => set({ table: event.currentTarget.value })}
        />
      )}
      <div className="plan-fields">
        <Select
          label={t`Plan`}
          data={[...METHODS()]}
          value={form.method}
          allowDeselect={false}
          onChange={(method) => {
            const found = METHODS().find((one) => one.value === method);
            if (found) set({ method: found.value });
          }}
        />
        {!grid && (
          <>
            <Whole
              label={t`Number of cases`}
              value={form.samples}
              onValue={(samples) => set({ samples })}
              least={1}
            />
            <Whole
              label={t`Random seed of the samples`}
              value={form.sampleSeed}
              onValue={(sampleSeed) => set({ sampleSeed })}
              least={0}
            />
          </>
        )}
        <NumberInput
          label={t`Random seed of the runs`}
          placeholder={t`the scenario's, ${document.seed}`}
          allowDecimal={false}
          min={0}
          value={form.seed ?? ""}
          onChange={(next) => set({ seed: typeof next === "number" ? next : null })}
        />
        <Bound
          label={t`Minimum TTC of a safe case`}
          suffix={" s"}
          value={form.ttc}
          onValue={(ttc) => set({ ttc })}
        />
        <Bound
          label={t`Minimum post-encroachment time`}
          suffix={" s"}
          value={form.pet}
          onValue={(pet) => set({ pet })}
        />
        <Bound
          label={t`Maximum required deceleration`}
          suffix={" m/s²"}
          value={form.drac}
          onValue={(drac) => set({ drac })}
        />
        <Whole
          label={t`Parallel runs`}
          value={form.processes}
          onValue={(processes) => set({ processes })}
          least={1}
          most={256}
        />
        <TagsInput
          className="plan-wide"
          label={t`Additional result columns`}
          placeholder={t`for example mean_speed`}
          data={[
            { group: t`Figures of runs`, items: names(figures) },
            { group: t`From plug-ins`, items: names(installed?.filter(({ error }) => !error)) },
          ]}
          value={[...form.figures]}
          onChange={(names) => set({ figures: names })}
        />
        <TagsInput
          className="plan-wide"
          label={t`More limits of a safe case, of any column`}
          placeholder={t`for example mean_speed >= 8`}
          value={[...form.limits]}
          onChange={(limits) => set({ limits })}
        />
      </div>
      {fault ? (
        <Text size="sm" role="status">
          {fault}
        </Text>
      ) : (
        <Text size="sm" role="status">
          <Trans>
            <Plural value={cases} one="# case" other="# cases" />, each a run of{" "}
            {shortNumber(document.simulation.duration)} s.
          </Trans>
        </Text>
      )}
      {failure && (
        <Alert color="red" title={t`This sweep is not possible`}>
          {failure}
        </Alert>
      )}
      {planned && (
        <Alert
          ref={answer}
          role="status"
          color={planned.disk > planned.free ? "red" : "blue"}
          title={planned.disk > planned.free ? t`Not enough disk space` : t`What it takes`}
        >
          {costOf(planned)}
        </Alert>
      )}
      {planned?.without_effect.length ? (
        <Alert role="status" color="yellow" title={t`Variables without effect`}>
          {planned.without_effect.map((sentence) => (
            <div key={sentence}>{served(sentence)}</div>
          ))}
        </Alert>
      ) : null}
      <Group>
        <Button
          variant={planned ? "default" : "filled"}
          loading={busy === "plan"}
          disabled={fault !== null || busy !== null}
          onClick={plan}
        >
          <Trans>Plan the sweep</Trans>
        </Button>
        {planned && (
          <Button loading={busy === "start"} disabled={busy !== null} onClick={start}>
            <Trans>
              Run <Plural value={planned.cases} one="# case" other="# cases" />
            </Trans>
          </Button>
        )}
      </Group>
    </div>
  );
}

type Named = [string, ScenarioDocument["parameters"][string]];

/** The units in which a table has its values. */
const names = (figures: readonly { name: string }[] | null | undefined): string[] =>
  (figures ?? []).map(({ name }) => name);

const unitsOf = (parameters: Named[]): string =>
  parameters.map(([name, { unit }]) => (unit ? `${name} (${unit})` : name)).join(", ");

/** How a table of the first two parameters may look. */
function exampleOf(parameters: Named[]): string {
  const some = parameters.slice(0, 2);
  const row = (share: number) =>
    some.map(([, { value, min, max }]) => shortNumber((min ?? value) * (1 - share) + (max ?? value) * share));
  return [some.map(([name]) => name), row(0), row(1)].map((words) => words.join(" ")).join("\n");
}

/** The forecast in a sentence. */
export function costOf(planned: PlannedSweep): string {
  const { cases, tried, case_seconds, seconds, disk, free, processes, patience } = planned;
  const room = t`${bytes(disk)} of disk (${bytes(free)} free)`;
  if (seconds === null)
    return t`${plural(cases, { one: "# case", other: "# cases" })}. One of them, ${tried}, was tried and takes more than ${patience} s.`;
  const one = t`One of them, ${tried}, was tried and took ${fixed(case_seconds, 1)} s`;
  const together = processes === 1 ? t`one after another` : t`${processes} at a time`;
  return t`${plural(cases, { one: "# case", other: "# cases" })}. ${one}: about ${lasting(seconds)} for all, ${together}, and ${room}.`;
}

/** A limit of a safe case; without a number there is none. */
function Bound({
  label,
  suffix,
  value,
  onValue,
}: {
  label: string;
  suffix: string;
  value: number | null;
  onValue: (value: number | null) => void;
}) {
  return (
    <NumberInput
      label={label}
      placeholder={t`no limit`}
      suffix={suffix}
      min={0}
      step={0.1}
      value={value ?? ""}
      onChange={(next) => onValue(typeof next === "number" ? next : null)}
    />
  );
}

function Whole({
  label,
  value,
  least,
  most = 100_000,
  onValue,
}: {
  label: string;
  value: number;
  least: number;
  most?: number;
  onValue: (value: number) => void;
}) {
  return (
    <NumberInput
      label={label}
      allowDecimal={false}
      min={least}
      max={most}
      value={value}
      onChange={(next) => {
        if (typeof next === "number") onValue(Math.max(least, next));
      }}
    />
  );
}
