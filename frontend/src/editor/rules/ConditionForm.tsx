import { Button, Group, SegmentedControl, Select } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { inSentence } from "../../ui/words";
import { localized } from "../../language/localized";
import { Committed } from "../Committed";
import { CONDITION_KINDS, conditionKind } from "./conditionKinds";
import { type Condition, type ConditionGroup, isGroup, type Join, newCondition, NOW, settled } from "./draft";
import { type About, FieldInput } from "./FieldInput";

const JOIN_WORD = localized((): Record<Join, string> => ({
  all: t`All of several hold`,
  any: t`Any of several holds`,
  not: t`Not (negation)`,
}));
const isJoin = (kind: string): kind is Join => kind in JOIN_WORD();
const EDGE = localized(() => ({ none: t`While true`, rising: t`When it becomes true` }));

type ConditionProps = About & {
  others: readonly string[];
  condition: Condition;
  onChange: (condition: Condition) => void;
};

/** When a rule fires: one condition, or a list of them that is joined. */
export function WhenForm({ condition, onChange, ...about }: ConditionProps) {
  const { others } = about;
  const listed = isGroup(condition) && condition.join !== "not" ? condition : null;
  const add = (): void => {
    const next = newCondition("time", others);
    if (listed) onChange({ ...listed, of: [...listed.of, next] });
    else {
      const { delay, edge } = condition;
      onChange({ join: "all", of: [{ ...condition, ...NOW }, next], delay, edge });
    }
  };
  return (
    <>
      {listed ? (
        <Parts group={listed} label={t`Condition`} root onChange={onChange} {...about} />
      ) : (
        <ConditionForm label={t`Condition`} condition={condition} timed onChange={onChange} {...about} />
      )}
      <Button size="compact-sm" variant="default" onClick={add}>
        <Trans>Add a condition</Trans>
      </Button>
      {listed && <TimingFields condition={listed} onChange={onChange} />}
    </>
  );
}

/** Conditions that are joined, each with its form. */
function Parts({
  group,
  label,
  root = false,
  onChange,
  ...about
}: About & {
  others: readonly string[];
  group: ConditionGroup;
  label: string;
  root?: boolean;
  onChange: (condition: Condition) => void;
}) {
  const put = (of: readonly Condition[]): void => {
    const [only] = of;
    // One that is left needs no list, unless both have times of their own.
    if (root && only && of.length === 1 && only.delay === 0 && only.edge === "none")
      onChange({ ...only, delay: group.delay, edge: group.edge });
    else onChange({ ...group, of });
  };
  const name = (n: number): string => (root ? `${label} ${n + 1}` : `${label}.${n + 1}`);
  return (
    <>
      {group.of.map((one, n) => (
        <ConditionForm
          key={n}
          label={name(n)}
          condition={one}
          timed={one.delay > 0 || one.edge !== "none"}
          onChange={(next) => put(group.of.map((each, k) => (k === n ? next : each)))}
          onRemove={
            group.join !== "not" && group.of.length > 1
              ? () => put(group.of.filter((_, k) => k !== n))
              : undefined
          }
          {...about}
        />
      ))}
      {root && group.of.length > 1 && (
        <SegmentedControl
          fullWidth
          aria-label={t`How conditions are joined`}
          data={[
            { value: "all", label: t`All hold` },
            { value: "any", label: t`Any holds` },
          ]}
          value={group.join}
          onChange={(join) => onChange({ ...group, join: join === "any" ? join : "all" })}
        />
      )}
      {!root && group.join !== "not" && (
        <Button
          size="compact-sm"
          variant="default"
          onClick={() => put([...group.of, newCondition("time", about.others)])}
        >
          {t`Add one to ${inSentence(label)}`}
        </Button>
      )}
    </>
  );
}

function ConditionForm({
  label,
  condition,
  timed,
  onChange,
  onRemove,
  ...about
}: ConditionProps & {
  label: string;
  /** Whether its delay and edge are shown at once. */
  timed: boolean;
  onRemove?: () => void;
}) {
  const { others, rules } = about;
  const [shown, setShown] = useState(timed);
  const kinds = Object.entries(CONDITION_KINDS()).filter(([value]) => value !== "rule" || rules.length > 0);
  const kind = isGroup(condition) ? condition.join : condition.kind;
  const choose = (next: string): void => {
    const { delay, edge } = condition;
    if (!isJoin(next)) onChange({ ...newCondition(next, others), delay, edge });
    else if (isGroup(condition) && condition.join !== "not" && next !== "not")
      onChange({ ...condition, join: next });
    else onChange({ join: next, of: [{ ...condition, ...NOW }], delay, edge });
  };
  return (
    <section className="fold" aria-label={label}>
      <Select
        label={label}
        data={[
          ...kinds.map(([value, one]) => ({ value, label: one.label })),
          ...Object.entries(JOIN_WORD()).map(([value, word]) => ({ value, label: word })),
        ]}
        value={kind}
        allowDeselect={false}
        onChange={(next) => {
          if (next && next !== kind) choose(next);
        }}
      />
      {isGroup(condition) ? (
        <Parts group={condition} label={label} onChange={onChange} {...about} />
      ) : (
        conditionKind(condition.kind)?.fields.map((field) => (
          <FieldInput
            key={`${condition.kind} ${field.label}`}
            where={label}
            field={field}
            values={condition.values}
            {...about}
            onChange={(values) =>
              onChange({ ...condition, values: settled(conditionKind(condition.kind), values, others) })
            }
          />
        ))
      )}
      {shown && <TimingFields condition={condition} onChange={onChange} />}
      <Group gap={6}>
        {!shown && (
          <Button
            size="compact-sm"
            variant="default"
            aria-label={t`When it counts: ${inSentence(label)}`}
            onClick={() => setShown(true)}
          >
            <Trans>When it counts</Trans>
          </Button>
        )}
        {onRemove && (
          <Button
            size="compact-sm"
            variant="default"
            aria-label={t`Remove ${inSentence(label)}`}
            onClick={onRemove}
          >
            <Trans>Remove</Trans>
          </Button>
        )}
      </Group>
    </section>
  );
}

/** How much later a condition counts, and whether only as it becomes true. */
function TimingFields({
  condition,
  onChange,
}: {
  condition: Condition;
  onChange: (condition: Condition) => void;
}) {
  return (
    <Group grow align="flex-start">
      <Committed
        label={t`Delay`}
        suffix={" s"}
        min={0}
        max={1e6}
        digits={1}
        value={condition.delay}
        onCommit={(delay) => onChange({ ...condition, delay: delay ?? 0 })}
      />
      <Select
        label={t({ message: "Counts", context: "a condition" })}
        data={Object.entries(EDGE()).map(([value, word]) => ({ value, label: word }))}
        value={condition.edge}
        allowDeselect={false}
        onChange={(edge) => onChange({ ...condition, edge: edge === "rising" ? edge : "none" })}
      />
    </Group>
  );
}
