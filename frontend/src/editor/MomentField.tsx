import { TextInput } from "@mantine/core";
import { useState } from "react";

import { momentText, readMoment, type TimeUnit } from "../language/moments";

/**
 * A moment of the run, in seconds after its start; it is shown and typed as a time of day if the
 * scenario has a clock, else as a number of units. It is sent when it is finished.
 */
export function MomentField({
  label,
  value,
  unit,
  step,
  placeholder,
  onCommit,
}: {
  label: string;
  value: number | null;
  unit: TimeUnit;
  /** Seconds that an arrow key changes it by. */
  step: number;
  placeholder?: string;
  onCommit: (moment: number | null) => void;
}) {
  const [wrong, setWrong] = useState<string | null>(null);
  const shown = value === null ? "" : momentText(value, unit);
  const commit = (text: string): void => {
    // What is shown is rounded: left as it is, it changes nothing.
    const read = text.trim() === shown ? value : readMoment(text, unit);
    setWrong(typeof read === "string" ? read : null);
    if (typeof read !== "string" && read !== value) onCommit(read);
  };
  return (
    <TextInput
      key={shown}
      label={label}
      placeholder={placeholder}
      defaultValue={shown}
      error={wrong}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => {
        const by = { ArrowUp: step, ArrowDown: -step }[event.key];
        if (event.key === "Enter") commit(event.currentTarget.value);
        if (by === undefined || value === null) return;
        event.preventDefault();
        onCommit(Math.max(0, value + by));
      }}
    />
  );
}
