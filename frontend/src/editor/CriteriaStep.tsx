import { Button, Loader, NumberInput, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { served } from "../language/served";
import { type ActorMeasureInfo, actorMeasures, allFigures, type FigureInfo } from "../api/figures";
import type { Edit, ScenarioDocument } from "../api/types";
import { useKeptForm } from "../ui/keptForm";
import { useLoaded } from "../ui/useLoaded";
import { type Criterion, criterionWords, EGO, OPERATORS, textOf, WHOLE_RUN } from "./criteria";
import { PartCard } from "./DemandParts";

/** What must come out of a run for it to pass, as sentences. */
export function CriteriaStep({
  document: { actors, criteria },
  onEdit,
}: {
  document: Pick<ScenarioDocument, "actors" | "criteria">;
  onEdit: (edit: Edit, label?: string) => void;
}) {
  const run = useLoaded(allFigures).value;
  const single = useLoaded(actorMeasures).value;
  if (!run || !single) return <Loader size="sm" aria-label={t`Loading what can be measured`} />;
  const change = (next: readonly string[], label: string): void =>
    onEdit({ kind: "set_criteria", criteria: [...next] }, label);
  const egos = actors.some(({ ego }) => ego);
  const ids = [...actors].sort((one, other) => Number(other.ego) - Number(one.ego)).map(({ id }) => id);
  const named = egos && !ids.includes(EGO) ? [EGO, ...ids] : ids;
  return (
    <>
      <Text size="sm">
        <Trans>
          What must come out of a run for it to pass. Each is judged when the run has ended, and suites of
          tests expect it.
        </Trans>
      </Text>
      {criteria.map((text, n) => {
        const words = criterionWords(text, { run, actors: single });
        return (
          <PartCard
            key={`${n} ${text}`}
            name={t`criterion ${n + 1}`}
            what=""
            onRemove={() =>
              change(
                criteria.filter((_, at) => at !== n),
                t`Remove a criterion`,
              )
            }
          >
            <Text size="sm">{words}</Text>
          </PartCard>
        );
      })}
      <NewCriterion
        run={run}
        single={single}
        ids={named}
        criteria={criteria}
        onAdd={(text) => change([...criteria, text], t`Add a criterion`)}
      />
    </>
  );
}

function NewCriterion({
  run,
  single,
  ids,
  criteria,
  onAdd,
}: {
  run: readonly FigureInfo[];
  single: readonly ActorMeasureInfo[];
  ids: readonly string[];
  criteria: readonly string[];
  onAdd: (text: string) => void;
}) {
  const [made, setMade] = useKeptForm<Criterion>("new criterion", {
    name: "collided",
    actor: WHOLE_RUN,
    op: "==",
    bound: 0,
    unit: "",
  });
  const measures = made.actor === WHOLE_RUN ? run : single;
  const measure = measures.find(({ name }) => name === made.name);
  const unit = measure?.unit ?? "";
  const about = (actor: string): void => {
    const offered = actor === WHOLE_RUN ? run : single;
    const kept = offered.some(({ name }) => name === made.name);
    setMade({ ...made, actor, name: kept ? made.name : (offered[0]?.name ?? made.name) });
  };
  const text = textOf({ ...made, unit: withUnit(unit) });
  return (
    <section className="fold" aria-label={t`New criterion`}>
      <Select
        label={t`About`}
        data={[{ value: WHOLE_RUN, label: t`The whole run` }, ...ids.map((id) => ({ value: id, label: id }))]}
        value={made.actor}
        allowDeselect={false}
        searchable={ids.length > 10}
        limit={50}
        onChange={(actor) => {
          if (actor !== null) about(actor);
        }}
      />
      <Select
        label={t`What`}
        description={measure?.definition}
        data={measures.map(({ name, label }) => ({ value: name, label: served(label) }))}
        value={made.name}
        allowDeselect={false}
        searchable
        onChange={(name) => {
          if (name !== null) setMade({ ...made, name });
        }}
      />
      <Select
        label={t`Is`}
        data={OPERATORS().map(([value, label]) => ({ value, label }))}
        value={made.op}
        allowDeselect={false}
        onChange={(op) => {
          if (op !== null) setMade({ ...made, op });
        }}
      />
      <NumberInput
        label={t`Number`}
        suffix={unit ? ` ${unit}` : ""}
        value={made.bound}
        decimalScale={3}
        onChange={(bound) => {
          if (typeof bound === "number") setMade({ ...made, bound });
        }}
      />
      <Button variant="default" disabled={criteria.includes(text)} onClick={() => onAdd(text)}>
        <Trans>Add the criterion</Trans>
      </Button>
    </section>
  );
}

/** Units of criteria are letters and a stroke; what has another one is written without. */
const withUnit = (unit: string): string => (/^[A-Za-z][A-Za-z/\d]*$/.test(unit) ? unit : "");
