import { NumberInput } from "@mantine/core";

import { shownAs } from "../language/units";
import { parsed } from "../language/numbers";

/**
 * A number that is sent when it is finished, not with every key. Its suffix says the unit of the value;
 * speeds in km/h and lengths in metres are shown in the unit of the reader.
 */
export function Committed({
  label,
  value,
  digits,
  suffix,
  min,
  max,
  onCommit,
  ...rest
}: {
  label: string;
  value: number | "";
  digits: number;
  suffix: string;
  min: number;
  max: number;
  step?: number;
  placeholder?: string;
  onCommit: (value: number | null) => void;
}) {
  const unit = shownAs(suffix);
  const places = digits + unit.digits;
  const shown = value === "" ? "" : Number((value * unit.scale).toFixed(places));
  const commit = (text: string): void => {
    const found = parsed(text);
    // What is shown is rounded: left as it is, it changes nothing.
    if ((Number.isNaN(found) ? "" : found) === shown) return;
    onCommit(Number.isNaN(found) ? null : Math.min(Math.max(found / unit.scale, min), max));
  };
  return (
    <NumberInput
      key={String(shown)}
      label={label}
      defaultValue={shown}
      decimalScale={places}
      suffix={unit.suffix}
      min={min * unit.scale}
      max={max * unit.scale}
      {...rest}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => {
        if (event.key === "Enter") commit(event.currentTarget.value);
      }}
    />
  );
}
