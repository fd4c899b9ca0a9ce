import { Select, Switch, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { short } from "../../language/numbers";
import { Committed } from "../Committed";
import { MomentField } from "../MomentField";
import { CommittedText, PickButton } from "../FormParts";
import type { PlacePick } from "../pick";
import { fieldStart, namesOf, placeText, readPlace } from "./draft";
import { type Field, listed, type OneOf, type PlainField, type Values } from "./fields";
import { PointsInput, PoseInput } from "./PointsInput";

/** What fields may be about. */
export interface About {
  /** Road users, the ego first. */
  actors: readonly string[];
  /** Ids of the other rules. */
  rules: readonly string[];
  pick: PlacePick;
}

export type FieldProps = About & {
  /** The condition or action, for the names of picked places. */
  where: string;
  values: Values;
  /** Road users but the one that acts. */
  others: readonly string[];
  onChange: (values: Values) => void;
};

const without = (values: Values, names: readonly string[]): Values =>
  Object.fromEntries(Object.entries(values).filter(([name]) => !names.includes(name)));

export function FieldInput({ field, ...props }: FieldProps & { field: Field }) {
  if (field.without?.(props.values)) return null;
  return field.is === "one" ? (
    <OneOfInput field={field} {...props} />
  ) : (
    <PlainInput field={field} {...props} />
  );
}

function OneOfInput({ field, ...props }: FieldProps & { field: OneOf }) {
  const { values, others, onChange } = props;
  const chosen = field.of.find(({ name }) => name in values) ?? field.of[0];
  if (!chosen) return null;
  return (
    <>
      <Select
        label={field.label}
        data={field.of.map(({ name, label }) => ({ value: name, label }))}
        value={chosen.name}
        allowDeselect={false}
        onChange={(name) => {
          const next = field.of.find((one) => one.name === name);
          if (next && next !== chosen)
            onChange({ ...without(values, namesOf(field)), ...fieldStart(next, others) });
        }}
      />
      <PlainInput field={chosen} {...props} />
    </>
  );
}

function PlainInput({ field, ...props }: FieldProps & { field: PlainField }) {
  const { values, actors, rules, onChange } = props;
  const { name, label } = field;
  const value = values[name];
  const set = (next: unknown): void =>
    onChange(next === null ? without(values, [name]) : { ...values, [name]: next });
  switch (field.is) {
    case "number":
      return <NumberField field={field} value={value} onChange={set} />;
    case "actor":
      return (
        <ChoiceInput
          label={label}
          value={value}
          data={actors.map((one) => ({ value: one, label: one }))}
          optional={field.optional}
          onChange={(next) => set(next ?? (field.optional ? null : ""))}
        />
      );
    case "rule":
      return (
        <ChoiceInput
          label={label}
          value={value}
          data={rules.map((one) => ({ value: one, label: one }))}
          onChange={set}
        />
      );
    case "choice":
      return (
        <ChoiceInput
          label={label}
          value={value ?? field.otherwise}
          data={Object.entries(field.choices).map(([one, word]) => ({ value: one, label: word }))}
          optional={field.optional}
          onChange={(next) => set(next === "true" || next === "false" ? next === "true" : next)}
        />
      );
    case "flag":
      return (
        <Switch
          label={label}
          checked={typeof value === "boolean" ? value : field.otherwise}
          onChange={(event) => set(event.currentTarget.checked)}
        />
      );
    case "place":
      return <PlaceInput field={field} value={value} where={props.where} pick={props.pick} onChange={set} />;
    case "points":
      return <PointsInput field={field} {...props} />;
    case "pose":
      return <PoseInput label={label} value={value} where={props.where} pick={props.pick} onChange={set} />;
    case "rows":
      return <Text size="sm">{rowsWords(value)}</Text>;
    case "name":
      return <CommittedText label={label} value={typeof value === "string" ? value : ""} onCommit={set} />;
    case "given":
      return listed(value) ? <Text size="sm">{`${label}: ${listed(value)}`}</Text> : null;
  }
}

/** A number in the unit that is shown. */
function NumberField({
  field,
  value,
  onChange,
}: {
  field: Extract<PlainField, { is: "number" }>;
  value: unknown;
  onChange: (value: number | null) => void;
}) {
  const { label, suffix, min, max, digits, scale, start, moment } = field;
  if (moment)
    return (
      <MomentField
        label={label}
        unit="s"
        step={1}
        value={typeof value === "number" ? value : null}
        onCommit={(next) => {
          if (next !== null) onChange(next);
        }}
      />
    );
  return (
    <Committed
      label={label}
      suffix={suffix}
      min={min}
      max={max}
      digits={digits}
      placeholder={start === undefined ? t`not given` : undefined}
      value={typeof value === "number" ? value * scale : ""}
      onCommit={(next) => {
        if (next !== null) onChange(next / scale);
        else if (start === undefined) onChange(null);
      }}
    />
  );
}

/** One of a list; a value that is not in it is kept. */
export function ChoiceInput({
  label,
  value,
  data,
  optional,
  onChange,
}: {
  label: string;
  value: unknown;
  data: readonly { value: string; label: string }[];
  optional?: boolean;
  onChange: (value: string | null) => void;
}) {
  const shown = value === undefined || value === null || value === "" ? null : String(value);
  const known = shown === null || data.some((one) => one.value === shown);
  return (
    <Select
      label={label}
      data={known ? [...data] : [...data, { value: shown, label: shown }]}
      value={shown}
      clearable={optional}
      placeholder={optional ? t`not given` : undefined}
      allowDeselect={false}
      onChange={onChange}
    />
  );
}

/** A place, light or movement that is typed, or pointed at on the map. */
function PlaceInput({
  field: { name, label, by, hint },
  value,
  where,
  pick,
  onChange,
}: {
  field: Extract<PlainField, { is: "place" }>;
  value: unknown;
  where: string;
  pick: PlacePick;
  onChange: (place: unknown) => void;
}) {
  const read = by === "place" ? readPlace : (typed: string) => typed;
  return (
    <>
      <CommittedText
        label={label}
        placeholder={hint}
        value={placeText(value)}
        onCommit={(typed) => onChange(read(typed))}
      />
      <PickButton
        pick={pick}
        pickKey={`rule ${where} ${name}`}
        by={by}
        onTake={(picked) => onChange(picked.name || [picked.x, picked.y])}
      >
        {t`${label} on the map`}
      </PickButton>
    </>
  );
}

function rowsWords(rows: unknown): string {
  if (!Array.isArray(rows) || rows.length === 0)
    return t`No trajectory: odscen replay reads one from a table.`;
  const last: unknown = rows.at(-1);
  const seconds = Array.isArray(last) && typeof last[0] === "number" ? last[0] : 0;
  return t`${rows.length} recorded rows over ${short(seconds, 1)} s; odscen replay reads others.`;
}
