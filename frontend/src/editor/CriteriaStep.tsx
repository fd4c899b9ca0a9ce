import { Button, Loader, NumberInput, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { served } from "../language/served";
import { type ActorMeasureInfo, actorMeasures, allFigures, type FigureInfo } from "../api/figures";
import type { Edit, ScenarioDocument } from "../api/types";
import { useKeptForm } from "../ui/keptForm";
import { useLoaded } from "../ui/useLoaded";
import {
  type Criterion,
  criterionWords,
  EGO,
  OPERATORS,
  suggestedCriteria,
  textOf,
  WHOLE_RUN,
} from "./criteria";
import { PartCard } from "./DemandParts";

/** What must come out of a run for it to pass, as sentences. */
export function CriteriaStep({
  document: { actors, rules, criteria },
  onEdit,
}: {
  document: Pick<ScenarioDocument, "actors" | "rules" | "criteria">;
  onEdit: (edit: Edit, label?: string) => void;
}) {
  const run = useLoaded(allFigures).value;
  const single = useLoaded(actorMeasures).value;
  if (!run || !single) return <Loader size="sm" aria-label={t`Loading what can be measured`} />;
  const change = (next: readonly string[], label: string): void =>
    onEdit({ kind: "set_criteria", criteria: [...next] }, label);
  const egos = actors.filter(({ ego }) => ego).map(({ id }) => id);
  const ids = [...actors].sort((one, other) => Number(other.ego) - Number(one.ego)).map(({ id }) => id);
  const named = egos.length > 0 && !ids.includes(EGO) ? [EGO, ...ids] : ids;
  const suggested = suggestedCriteria(actors, criteria);
  return (
    <>
      <Text size="sm">
        <Trans>
          What must come out of a run for it to pass. Each is judged when the run has ended, and is also
          checked by regression tests.
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
      {suggested.length > 0 && (
        <section className="fold" aria-label={t`Suggestions`}>
          <Text size="sm" fw={500}>
            <Trans>Often asked</Trans>
          </Text>
          {suggested.map((text) => (
            <Button
              key={text}
              size="compact-sm"
              variant="default"
              className="wrapping"
              justify="flex-start"
              onClick={() => change([...criteria, text], t`Add a criterion`)}
            >
              {criterionWords(text, { run, actors: single })}
            </Button>
          ))}
        </section>
      )}
      <NewCriterion
        run={run}
        single={single}
        ids={named}
        egos={egos}
        rules={rules.map(({ id }) => id)}
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
  egos,
  rules,
  criteria,
  onAdd,
}: {
  run: readonly FigureInfo[];
  single: readonly ActorMeasureInfo[];
  ids: readonly string[];
  /** Whom "ego" means, where no road user has this id. */
  egos: readonly string[];
  rules: readonly string[];
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
  const [subject = "", other] = made.actor.split(",");
  const offeredTo = (actor: string): readonly FigureInfo[] | readonly ActorMeasureInfo[] =>
    actor === WHOLE_RUN
      ? run
      : single.filter(
          ({ about }) => (about === "rule") === isRule(actor) && (about !== "pair" || ids.length > 1),
        );
  const isRule = (actor: string): boolean => !ids.includes(actor) && rules.includes(actor);
  const measures = offeredTo(subject);
  const measure = measures.find(({ name }) => name === made.name);
  const unit = measure?.unit ?? "";
  const others = ids.filter((id) => id !== subject && !(subject === EGO && egos.includes(id)));
  const put = (actor: string, name: string): void => {
    const offered = offeredTo(actor);
    const chosen = offered.find((one) => one.name === name) ?? offered[0];
    const pair = chosen !== undefined && "about" in chosen && chosen.about === "pair";
    const rest = ids.filter((id) => id !== actor && !(actor === EGO && egos.includes(id)));
    const to = other !== undefined && rest.includes(other) ? other : (rest[0] ?? "");
    setMade({ ...made, actor: pair ? `${actor},${to}` : actor, name: chosen?.name ?? name });
  };
  const text = textOf({ ...made, unit: withUnit(unit) });
  return (
    <section className="fold" aria-label={t`New criterion`}>
      <Select
        label={t`About`}
        data={[
          { value: WHOLE_RUN, label: t`The whole run` },
          ...ids.map((id) => ({ value: id, label: id })),
          ...rules.filter((id) => !ids.includes(id)).map((id) => ({ value: id, label: t`Rule ${id}` })),
        ]}
        value={subject}
        allowDeselect={false}
        searchable={ids.length + rules.length > 10}
        limit={50}
        onChange={(actor) => {
          if (actor !== null) put(actor, made.name);
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
          if (name !== null) put(subject, name);
        }}
      />
      {other !== undefined && (
        <Select
          label={t`Other road user`}
          data={others}
          value={other}
          allowDeselect={false}
          searchable={others.length > 10}
          onChange={(to) => {
            if (to !== null) setMade({ ...made, actor: `${subject},${to}` });
          }}
        />
      )}
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
