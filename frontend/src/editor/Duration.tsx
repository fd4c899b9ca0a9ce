import { Group, NumberInput, Select } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useState } from "react";

import { parsed } from "../language/numbers";
import { localized } from "../language/localized";

const UNITS = localized(() => [
  { value: "1", label: t`seconds` },
  { value: "60", label: t`minutes` },
  { value: "3600", label: t`hours` },
]);

/** The largest unit in which a time is a whole number, in seconds. */
export const unitOf = (seconds: number): number =>
  [3600, 60].find((unit) => seconds > unit && seconds % unit === 0) ?? 1;

/** A length of time in the unit that one thinks in; committed in seconds when it is finished. */
export function Duration({
  label,
  seconds,
  onCommit,
}: {
  label: string;
  seconds: number;
  onCommit: (seconds: number) => void;
}) {
  const [unit, setUnit] = useState(unitOf(seconds));
  const commit = (text: string): void => {
    const value = Math.round(parsed(text) * unit * 1000) / 1000;
    if (value > 0 && value !== seconds) onCommit(value);
  };
  return (
    <Group gap={6} wrap="nowrap" align="flex-end">
      <NumberInput
        key={`${seconds} ${unit}`}
        style={{ flex: 1 }}
        label={label}
        min={1 / unit}
        max={1e6 / unit}
        decimalScale={3}
        defaultValue={seconds / unit}
        onBlur={(event) => commit(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === "Enter") commit(event.currentTarget.value);
        }}
      />
      <Select
        w={126}
        aria-label={t`${label}: unit`}
        data={UNITS()}
        value={String(unit)}
        allowDeselect={false}
        onChange={(value) => setUnit(Number(value))}
      />
    </Group>
  );
}
