import { Button, Group, NumberInput, Select, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useMemo, useState } from "react";

import type { Edit, ScenarioDocument } from "../api/types";
import { hashOf } from "../ui/address";
import { ParameterCard } from "./ParameterCard";
import {
  boundsFor,
  type DocumentNumber,
  isName,
  nameFor,
  numbersOf,
  ownerOf,
  shortNumber,
  usesOf,
} from "./parameters";

type Shown = Pick<ScenarioDocument, "actors" | "flows" | "rules" | "simulation" | "parameters" | "formulas">;

/** Named numbers with sliders; whatever is computed from them follows at once. */
export function ParametersStep({
  name,
  document,
  onEdit,
  onShow,
}: {
  /** Of the scenario's file. */
  name: string;
  document: Shown;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  /** Brings the road user or the rule with this id into sight. */
  onShow: (owner: { root: string; id: string }) => void;
}) {
  const { parameters, formulas } = document;
  const free = useMemo(
    () => numbersOf(document).filter(({ place }) => formulas[place] === undefined),
    [document, formulas],
  );
  const show = (place: string): (() => void) | null => {
    const owner = ownerOf(place);
    return owner.root === "simulation" || owner.root === "parameters" ? null : () => onShow(owner);
  };
  const names = Object.keys(parameters);
  return (
    <>
      <Text size="sm">
        <Trans>
          Numbers with a name and bounds. Turn one, and everything that is computed from it follows; a sweep
          runs the scenario with many values.
        </Trans>
      </Text>
      {Object.entries(parameters).map(([one, parameter]) => (
        <ParameterCard
          key={one}
          name={one}
          parameter={parameter}
          formula={formulas[`parameters/${one}/value`]}
          uses={usesOf(formulas, one)}
          free={free}
          onEdit={onEdit}
          onShow={show}
        />
      ))}
      {names.length > 0 && (
        <Button component="a" href={hashOf({ view: "sweeps", scenario: name })}>
          <Trans>Sweep the parameters</Trans>
        </Button>
      )}
      <NewParameter free={free} names={names} onEdit={onEdit} />
    </>
  );
}

/** Makes a number of the document a parameter, in one step. */
function NewParameter({
  free,
  names,
  onEdit,
}: {
  free: readonly DocumentNumber[];
  names: readonly string[];
  onEdit: (edit: readonly Edit[], label?: string) => void;
}) {
  const [place, setPlace] = useState<string | null>(null);
  const [name, setName] = useState("");
  const [unit, setUnit] = useState("");
  const [value, setValue] = useState(10);
  const [bounds, setBounds] = useState(boundsFor(10));
  const choose = (chosen: string | null): void => {
    setPlace(chosen);
    const found = free.find((one) => one.place === chosen);
    if (!found) return;
    const now = found.value ?? 10;
    setName(nameFor(found.place, names));
    setValue(now);
    setBounds(boundsFor(now));
  };
  const [min, max] = bounds;
  const wrong = !isName(name)
    ? name && t`Letters, digits and _, beginning with a letter`
    : names.includes(name)
      ? t`There is one of that name`
      : null;
  const add = (): void => {
    const made: Edit = { kind: "set_parameter", parameter: name, value, unit, min, max };
    const computed: Edit[] = place === null ? [] : [{ kind: "set_formula", place, formula: `$${name}` }];
    onEdit([made, ...computed], t`Parameter ${name}`);
    setPlace(null);
    setName("");
    setUnit("");
  };
  return (
    <section className="fold" aria-label={t`New parameter`}>
      <Select
        label={t`Value to vary`}
        placeholder={t`Choose a number of the scenario`}
        searchable
        clearable
        limit={100}
        value={place}
        data={free.map((one) => ({
          value: one.place,
          label: `${one.label}${one.value === null ? "" : t`, now ${shortNumber(one.value)}`}`,
        }))}
        onChange={choose}
      />
      <TextInput
        label={t`Name of the parameter`}
        value={name}
        error={wrong}
        maxLength={64}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group grow align="flex-start">
        <NumberInput
          label={t`Value`}
          value={value}
          onChange={(next) => {
            if (typeof next === "number") setValue(next);
          }}
        />
        <TextInput
          label={t`Unit`}
          value={unit}
          maxLength={40}
          onChange={(event) => setUnit(event.currentTarget.value)}
        />
      </Group>
      <Group grow align="flex-start">
        <NumberInput
          label={t`From`}
          value={min}
          onChange={(next) => {
            if (typeof next === "number") setBounds([next, max]);
          }}
        />
        <NumberInput
          label={t`To`}
          value={max}
          onChange={(next) => {
            if (typeof next === "number") setBounds([min, next]);
          }}
        />
      </Group>
      <Button variant="default" disabled={!name || Boolean(wrong)} onClick={add}>
        <Trans>Add the parameter</Trans>
      </Button>
    </section>
  );
}
