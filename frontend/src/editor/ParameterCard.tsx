import { ActionIcon, Button, Group, Select, Slider, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import type { Edit } from "../api/types";
import { IconTrash } from "../ui/icons";
import { Committed } from "./Committed";
import { PartCard } from "./DemandParts";
import { CommittedText } from "./FormParts";
import {
  type ComputedNumber,
  type DocumentNumber,
  isName,
  type Parameter,
  shortNumber,
  stepOf,
} from "./parameters";

const FAR = 1e9;

/** One parameter: its slider, what is computed from it, and a form for the rest. */
export function ParameterCard({
  name,
  parameter,
  formula,
  uses,
  free,
  onEdit,
  onShow,
}: {
  name: string;
  parameter: Parameter;
  /** What it is itself computed by. */
  formula: string | undefined;
  uses: readonly ComputedNumber[];
  /** Numbers that are not computed yet. */
  free: readonly DocumentNumber[];
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  /** Shows whose number this is; null where there is nothing to show. */
  onShow: (place: string) => (() => void) | null;
}) {
  const [open, setOpen] = useState(false);
  const { value, unit, min, max, description } = parameter;
  const set = (fields: Partial<Parameter>): void =>
    onEdit({ kind: "set_parameter", parameter: name, ...fields });
  const suffix = unit ? ` ${unit}` : "";
  return (
    <PartCard
      name={name}
      what={description || t`Parameter`}
      note={`${shortNumber(value)}${suffix}`}
      onRemove={() => onEdit({ kind: "remove_parameter", parameter: name })}
    >
      {formula === undefined ? (
        <>
          {min !== null && max !== null && min < max && (
            <ValueSlider name={name} value={value} unit={unit} min={min} max={max} onValue={set} />
          )}
          <Committed
            label={t`Value of ${name}`}
            suffix={suffix}
            digits={6}
            min={min ?? -FAR}
            max={max ?? FAR}
            value={value}
            onCommit={(next) => {
              if (next !== null) set({ value: next });
            }}
          />
        </>
      ) : (
        <Text size="sm">
          <Trans>Computed: {formula}</Trans>
        </Text>
      )}
      {uses.map(({ place, label, formula: text }) => (
        <Computed
          key={place}
          label={label}
          formula={text}
          onFormula={(next) => onEdit({ kind: "set_formula", place, formula: next })}
          onShow={onShow(place)}
        />
      ))}
      {uses.length === 0 && (
        <Text size="sm">
          <Trans>Nothing is computed from it yet.</Trans>
        </Text>
      )}
      <Select
        label={t`Link another value to ${name}`}
        placeholder={t`Choose a number`}
        searchable
        limit={100}
        value={null}
        data={free.map(({ place, label, value: now }) => ({
          value: place,
          label: `${label}${now === null ? "" : t`, now ${shortNumber(now)}`}`,
        }))}
        onChange={(place) => {
          if (place !== null) onEdit({ kind: "set_formula", place, formula: `$${name}` });
        }}
      />
      <Group gap={6}>
        <Button
          size="compact-sm"
          variant="default"
          aria-expanded={open}
          aria-label={`${open ? t`Done` : t`Change`} ${name}`}
          onClick={() => setOpen(!open)}
        >
          {open ? t`Done` : t`Name, unit and bounds`}
        </Button>
      </Group>
      {open && (
        <>
          <CommittedText
            label={t`Name`}
            value={name}
            maxLength={64}
            onCommit={(next) => {
              if (isName(next)) onEdit({ kind: "set_parameter", parameter: next, instead_of: name });
            }}
          />
          <CommittedText
            label={t`What it is`}
            value={description}
            maxLength={1000}
            onCommit={(next) => set({ description: next })}
          />
          <CommittedText
            label={t`Unit`}
            value={unit}
            maxLength={40}
            onCommit={(next) => set({ unit: next })}
          />
          <Group grow align="flex-start">
            <Committed
              label={t`Least`}
              suffix={suffix}
              digits={6}
              min={-FAR}
              max={FAR}
              placeholder={t`any`}
              value={min ?? ""}
              onCommit={(next) => set({ min: next })}
            />
            <Committed
              label={t`Greatest`}
              suffix={suffix}
              digits={6}
              min={-FAR}
              max={FAR}
              placeholder={t`any`}
              value={max ?? ""}
              onCommit={(next) => set({ max: next })}
            />
          </Group>
        </>
      )}
    </PartCard>
  );
}

/** Follows the hand, and sends the value when it is let go. */
function ValueSlider({
  name,
  value,
  unit,
  min,
  max,
  onValue,
}: {
  name: string;
  value: number;
  unit: string;
  min: number;
  max: number;
  onValue: (fields: { value: number }) => void;
}) {
  const [shown, setShown] = useState(value);
  useEffect(() => setShown(value), [value]);
  const said = (one: number): string => `${shortNumber(one)}${unit ? ` ${unit}` : ""}`;
  return (
    <Slider
      mb={22}
      mx={18}
      thumbLabel={name}
      min={min}
      max={max}
      step={stepOf(min, max)}
      value={shown}
      label={said}
      marks={[
        { value: min, label: said(min) },
        { value: max, label: said(max) },
      ]}
      onChange={setShown}
      onChangeEnd={(next) => {
        if (next !== value) onValue({ value: Number(next.toPrecision(9)) });
      }}
    />
  );
}

/** A number that is computed: its formula, and where it is. */
function Computed({
  label,
  formula,
  onFormula,
  onShow,
}: {
  label: string;
  formula: string;
  onFormula: (formula: string | null) => void;
  onShow: (() => void) | null;
}) {
  return (
    <Group gap={6} align="flex-end" wrap="nowrap">
      <div style={{ flex: 1, minWidth: 0 }}>
        <CommittedText
          label={label}
          value={formula}
          maxLength={500}
          onCommit={(text) => {
            if (text) onFormula(text);
          }}
        />
      </div>
      {onShow && (
        <Button size="sm" px={8} variant="default" aria-label={t`Show where ${label} is`} onClick={onShow}>
          <Trans>Show</Trans>
        </Button>
      )}
      <ActionIcon
        variant="subtle"
        color="gray"
        size="lg"
        aria-label={t`Unlink ${label}`}
        onClick={() => onFormula(null)}
      >
        <IconTrash />
      </ActionIcon>
    </Group>
  );
}
