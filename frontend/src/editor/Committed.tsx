import { NumberInput } from "@mantine/core";

/** A number that is sent when it is finished, not with every key. */
export function Committed({
  label,
  value,
  digits,
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
  const shown = value === "" ? "" : Number(value.toFixed(digits));
  const commit = (text: string): void => {
    const found = Number.parseFloat(text);
    const next = Number.isNaN(found) ? null : Math.min(Math.max(found, rest.min), rest.max);
    if (next !== (shown === "" ? null : shown)) onCommit(next);
  };
  return (
    <NumberInput
      key={String(shown)}
      label={label}
      defaultValue={shown}
      decimalScale={digits}
      {...rest}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => {
        if (event.key === "Enter") commit(event.currentTarget.value);
      }}
    />
  );
}
