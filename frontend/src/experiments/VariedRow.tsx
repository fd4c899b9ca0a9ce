import { NumberInput, SegmentedControl, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { shortNumber } from "../editor/parameters";
import { localized } from "../language/localized";
import { shownUnit } from "../language/units";
import { setOf, type Varied } from "./plan";

const HOW = localized(() => [
  { value: "fixed", label: t`Fixed` },
  { value: "range", label: t`Range` },
  { value: "set", label: t`Set` },
]);

/** One parameter of the form: fixed, a range, or a set of values. */
export function VariedRow({
  name,
  unit,
  value,
  description,
  computed,
  grid,
  inTable,
  varied,
  onVaried,
}: {
  name: string;
  unit: string;
  value: number;
  description: string;
  computed: string | undefined;
  grid: boolean;
  /** Whether the table of values that belong together has it. */
  inTable: boolean;
  varied: Varied | undefined;
  onVaried: (varied: Varied) => void;
}) {
  if (!varied) return null;
  const { sign, shown, kept } = shownUnit(unit);
  const suffix = sign ? ` ${sign}` : "";
  const number = (label: string, key: "low" | "high") => (
    <NumberInput
      label={label}
      aria-label={t`${label} of ${name}`}
      suffix={suffix}
      value={shown(varied[key])}
      onChange={(next) => {
        if (typeof next === "number") onVaried({ ...varied, [key]: kept(next) });
      }}
    />
  );
  return (
    <section className="fold varied" aria-label={t`Parameter ${name}`}>
      <div className="varied-name">
        <Text fw={600} size="sm">
          {name}
        </Text>
        <Text size="xs" c="dimmed">
          {[description, t`now ${shortNumber(shown(value))}${suffix}`].filter(Boolean).join(", ")}
        </Text>
      </div>
      {computed !== undefined ? (
        <Text size="sm">
          <Trans>Computed: {computed}</Trans>
        </Text>
      ) : inTable ? (
        <Text size="sm">
          <Trans>In the table</Trans>
        </Text>
      ) : (
        <SegmentedControl
          size="xs"
          aria-label={t`How ${name} is varied`}
          data={HOW()}
          value={varied.how}
          onChange={(how) => onVaried({ ...varied, how: how as Varied["how"] })}
        />
      )}
      {!inTable && varied.how === "range" && (
        <>
          {number(t`From`, "low")}
          {number(t`To`, "high")}
          {grid && (
            <NumberInput
              label={t`Values`}
              aria-label={t`Values of ${name}`}
              allowDecimal={false}
              min={2}
              max={10_000}
              value={varied.steps}
              onChange={(next) => {
                if (typeof next === "number") onVaried({ ...varied, steps: Math.max(2, next) });
              }}
            />
          )}
        </>
      )}
      {!inTable && varied.how === "set" && (
        <SetInput
          label={t`Values, between commas${sign ? `, ${sign}` : ""}`}
          name={name}
          values={varied.values}
          shown={shown}
          kept={kept}
          onValues={(values) => onVaried({ ...varied, values })}
        />
      )}
    </section>
  );
}

/** Numbers of a set, typed in the unit of the reader; the form has them in the parameter's own. */
function SetInput({
  label,
  name,
  values,
  shown,
  kept,
  onValues,
}: {
  label: string;
  name: string;
  values: string;
  shown: (value: number) => number;
  kept: (shown: number) => number;
  onValues: (values: string) => void;
}) {
  const [typed, setTyped] = useState(() => setOf(values)?.map(shown).join(", ") ?? values);
  return (
    <TextInput
      label={label}
      aria-label={t`Values of ${name}`}
      value={typed}
      onChange={({ currentTarget: { value } }) => {
        setTyped(value);
        onValues(setOf(value)?.map(kept).join(", ") ?? value);
      }}
    />
  );
}
