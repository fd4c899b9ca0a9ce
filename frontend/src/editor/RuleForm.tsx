import { Button, Group, SegmentedControl, Select, Stack, Text, TextInput } from "@mantine/core";
import { useState } from "react";

import { Committed } from "./Committed";
import type { PlacePick } from "./pick";
import { useTaking } from "./pick";
import {
  ACTION_KINDS,
  actionKind,
  CONDITION_KINDS,
  conditionKind,
  type Draft,
  type Field,
  fieldStart,
  type Item,
  missing,
  newItem,
  placeText,
  readPlace,
  sentence,
  type Values,
} from "./rules";

interface About {
  /** Road users, the ego first. */
  actors: readonly string[];
  /** Ids of the other rules. */
  rules: readonly string[];
  pick: PlacePick;
}

/** A rule that is being made or changed: nothing is sent before it is whole. */
export function RuleForm({
  draft: begun,
  saveLabel,
  actors,
  rules,
  pick,
  onSave,
  onCancel,
}: About & {
  draft: Draft;
  saveLabel: string;
  onSave: (draft: Draft) => void;
  onCancel: () => void;
}) {
  const [draft, setDraft] = useState(begun);
  const put = (fields: Partial<Draft>): void => setDraft((old) => ({ ...old, ...fields }));
  const lacking = missing(draft);
  const about = { actors, rules, pick };
  return (
    <Stack gap={8}>
      <ActorSelect
        label="Who acts"
        value={draft.actor}
        actors={actors}
        onChange={(actor) => put({ actor: actor ?? "" })}
      />
      <Items
        word="Condition"
        items={draft.conditions}
        kinds={CONDITION_KINDS}
        kindOf={conditionKind}
        actor={draft.actor}
        {...about}
        onChange={(conditions) => put({ conditions })}
      />
      {draft.conditions.length > 1 && (
        <SegmentedControl
          fullWidth
          aria-label="How conditions are joined"
          data={[
            { value: "all", label: "All hold" },
            { value: "any", label: "Any holds" },
          ]}
          value={draft.join}
          onChange={(join) => put({ join: join === "any" ? join : "all" })}
        />
      )}
      <Committed
        label="Delay"
        suffix=" s"
        min={0}
        max={1e6}
        digits={1}
        value={draft.delay}
        onCommit={(delay) => put({ delay: delay ?? 0 })}
      />
      <Items
        word="Action"
        items={draft.actions}
        kinds={ACTION_KINDS}
        kindOf={actionKind}
        actor={draft.actor}
        {...about}
        onChange={(actions) => put({ actions })}
      />
      <Text size="sm" role="status">
        {sentence(draft)}
      </Text>
      {lacking.length > 0 && <Text size="sm">Still to give: {lacking.join(", ")}.</Text>}
      <Group gap={6}>
        <Button disabled={lacking.length > 0} onClick={() => onSave(draft)}>
          {saveLabel}
        </Button>
        <Button variant="default" onClick={onCancel}>
          Cancel
        </Button>
      </Group>
    </Stack>
  );
}

function Items({
  word,
  items,
  kinds,
  kindOf,
  actor,
  onChange,
  ...about
}: About & {
  word: "Condition" | "Action";
  items: readonly Item[];
  kinds: Record<string, { label: string }>;
  kindOf: typeof conditionKind;
  actor: string;
  onChange: (items: readonly Item[]) => void;
}) {
  const others = about.actors.filter((one) => one !== actor);
  const data = Object.entries(kinds)
    .filter(([value]) => value !== "rule" || about.rules.length > 0)
    .map(([value, { label }]) => ({ value, label }));
  const put = (at: number, item: Item): void => onChange(items.map((one, n) => (n === at ? item : one)));
  const fresh = (kind: string): Item => newItem(kind, kindOf(kind), others);
  return (
    <>
      {items.map((item, at) => {
        const label = items.length > 1 ? `${word} ${at + 1}` : word;
        return (
          <section key={at} className="fold" aria-label={label}>
            <Select
              label={label}
              data={data}
              value={item.kind}
              allowDeselect={false}
              onChange={(kind) => {
                if (kind && kind !== item.kind) put(at, fresh(kind));
              }}
            />
            {kindOf(item.kind)?.fields.map((field) => (
              <FieldInput
                key={`${item.kind} ${field.label}`}
                where={label}
                field={field}
                values={item.values}
                others={others}
                {...about}
                onChange={(values) => put(at, { ...item, values })}
              />
            ))}
            {items.length > 1 && (
              <Button
                size="compact-sm"
                variant="default"
                aria-label={`Remove ${label.toLowerCase()}`}
                onClick={() => onChange(items.filter((_, n) => n !== at))}
              >
                Remove
              </Button>
            )}
          </section>
        );
      })}
      <Button
        size="compact-sm"
        variant="default"
        onClick={() => onChange([...items, fresh(word === "Condition" ? "time" : "brake")])}
      >
        {word === "Condition" ? "Add a condition" : "Then another action"}
      </Button>
    </>
  );
}

type FieldProps = About & {
  /** The condition or action, for the names of picked places. */
  where: string;
  values: Values;
  others: readonly string[];
  onChange: (values: Values) => void;
};

const without = (values: Values, names: readonly string[]): Values =>
  Object.fromEntries(Object.entries(values).filter(([name]) => !names.includes(name)));

function FieldInput({ field, ...props }: FieldProps & { field: Field }) {
  const { values, others, onChange } = props;
  if (field.is !== "one") return <OneField field={field} {...props} />;
  const chosen = field.of.find(({ name }) => name in values) ?? field.of[0];
  if (!chosen) return null;
  const names = field.of.map(({ name }) => name);
  return (
    <>
      <Select
        label={field.label}
        data={field.of.map(({ name, label }) => ({ value: name, label }))}
        value={chosen.name}
        allowDeselect={false}
        onChange={(name) => {
          const next = field.of.find((one) => one.name === name);
          if (next && next !== chosen) onChange({ ...without(values, names), ...fieldStart(next, others) });
        }}
      />
      <OneField field={chosen} {...props} />
    </>
  );
}

function OneField({ field, ...props }: FieldProps & { field: Exclude<Field, { is: "one" }> }) {
  const { values, actors, rules, onChange } = props;
  const { name, label } = field;
  const value = values[name];
  const set = (next: unknown): void =>
    onChange(next === null ? without(values, [name]) : { ...values, [name]: next });
  switch (field.is) {
    case "number": {
      const scale = field.scale ?? 1;
      return (
        <Committed
          label={label}
          suffix={field.suffix}
          min={field.min}
          max={field.max}
          digits={field.digits ?? 1}
          placeholder={field.start === undefined ? "not given" : undefined}
          value={typeof value === "number" ? value * scale : ""}
          onCommit={(next) => {
            if (next !== null) set(next / scale);
            else if (field.start === undefined) set(null);
          }}
        />
      );
    }
    case "actor":
      return (
        <ActorSelect
          label={label}
          value={typeof value === "string" ? value : ""}
          actors={actors}
          clearable={field.optional}
          onChange={(next) => set(next ?? (field.optional ? null : ""))}
        />
      );
    case "place":
      return (
        <PlaceInput
          label={label}
          pickKey={`rule ${props.where} ${name}`}
          value={value}
          pick={props.pick}
          onChange={set}
        />
      );
    case "rule":
    case "choice":
      return (
        <Select
          label={label}
          data={
            field.is === "rule"
              ? [...rules]
              : Object.entries(field.choices).map(([one, word]) => ({ value: one, label: word }))
          }
          value={typeof value === "string" && value ? value : null}
          allowDeselect={false}
          onChange={(next) => {
            if (next) set(next);
          }}
        />
      );
    case "text":
      return (
        <TextInput
          label={label}
          value={typeof value === "string" ? value : ""}
          onChange={(event) => set(event.currentTarget.value.trim())}
        />
      );
  }
}

function ActorSelect({
  label,
  value,
  actors,
  clearable,
  onChange,
}: {
  label: string;
  value: string;
  actors: readonly string[];
  clearable?: boolean;
  onChange: (actor: string | null) => void;
}) {
  return (
    <Select
      label={label}
      data={value && !actors.includes(value) ? [...actors, value] : [...actors]}
      value={value || null}
      clearable={clearable}
      allowDeselect={false}
      onChange={onChange}
    />
  );
}

/** A place that is typed, or pointed at on the map. */
function PlaceInput({
  label,
  pickKey,
  value,
  pick,
  onChange,
}: {
  label: string;
  pickKey: string;
  value: unknown;
  pick: PlacePick;
  onChange: (place: unknown) => void;
}) {
  const active = useTaking(pick, pickKey, ({ name }) => {
    onChange(name);
    pick.stop();
  });
  const shown = placeText(value);
  return (
    <>
      <TextInput
        key={shown}
        label={label}
        placeholder="a node, or x, y in metres"
        defaultValue={shown}
        onBlur={(event) => {
          if (event.currentTarget.value !== shown) onChange(readPlace(event.currentTarget.value));
        }}
      />
      <Button
        size="compact-sm"
        variant={active ? "filled" : "default"}
        aria-pressed={active}
        onClick={() => (active ? pick.stop() : pick.start(pickKey, "node"))}
      >
        {active ? "Stop choosing" : `${label} on the map`}
      </Button>
    </>
  );
}
