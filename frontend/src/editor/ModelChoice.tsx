import { Alert, Checkbox, NumberInput, Select, Text, TextInput } from "@mantine/core";
import { Plural } from "@lingui/react/macro";

import type { Chosen, Offered, OfferedOption, OptionValue } from "../api/models";
import { served } from "../language/served";
import { useLoaded } from "../ui/useLoaded";

const NONE = "";
/** Options that do not push away what is below them. */
const FEW = 4;

/** What is to be done by an installed model, with its options, or by none of them. */
export function ModelChoice({
  offered,
  label,
  none,
  words,
  unusable,
  chosen,
  onChange,
}: {
  offered: () => Promise<Offered[]>;
  label: string;
  /** What does it without one. */
  none: string;
  /** What a model is called, of its name. */
  words: (name: string) => string;
  /** Title of the reason why one cannot be used. */
  unusable: string;
  chosen: Chosen | null;
  onChange: (chosen: Chosen | null) => void;
}) {
  const all = useLoaded(offered);
  if (!all.value) return null;
  const model = all.value.find(({ name }) => name === chosen?.name);
  return (
    <>
      <Select
        label={label}
        data={[
          { value: NONE, label: none },
          ...all.value.map(({ name }) => ({ value: name, label: words(name) })),
        ]}
        value={chosen?.name ?? NONE}
        allowDeselect={false}
        onChange={(name) => onChange(name ? { name, options: {} } : null)}
      />
      {chosen &&
        model &&
        (model.error ? (
          <Alert color="red" title={unusable}>
            {served(model.error)}
          </Alert>
        ) : (
          <Options model={model} chosen={chosen} onChange={onChange} />
        ))}
    </>
  );
}

function Options({
  model,
  chosen,
  onChange,
}: {
  model: Offered;
  chosen: Chosen;
  onChange: (chosen: Chosen) => void;
}) {
  const change = (name: string, value: OptionValue | null): void => {
    const others = Object.entries(chosen.options).filter(([other]) => other !== name);
    onChange({
      ...chosen,
      options: Object.fromEntries(value === null ? others : [...others, [name, value]]),
    });
  };
  const fields = model.options.map((option) => (
    <OptionField
      key={`${model.name} ${option.name}`}
      option={option}
      value={chosen.options[option.name] ?? option.usual}
      onChange={(value) => change(option.name, value)}
    />
  ));
  return (
    <>
      {model.summary && (
        <Text size="sm" c="dimmed">
          {served(model.summary)}
        </Text>
      )}
      {fields.length > FEW ? (
        <details>
          <summary>
            <Plural value={fields.length} one="# option" other="# options" />
          </summary>
          {fields}
        </details>
      ) : (
        fields
      )}
    </>
  );
}

/** One option: `null` is its usual value. */
function OptionField({
  option: { kind, title, meaning, low, high, choices, usual },
  value,
  onChange,
}: {
  option: OfferedOption;
  value: OptionValue | null;
  onChange: (value: OptionValue | null) => void;
}) {
  const shown = { label: served(title), description: meaning ? served(meaning) : undefined };
  if (kind === "boolean")
    return (
      <Checkbox
        {...shown}
        checked={value === true}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
    );
  if (kind === "string")
    return choices.length > 0 ? (
      <Select {...shown} data={choices} value={value === null ? null : String(value)} onChange={onChange} />
    ) : (
      <TextInput
        {...shown}
        value={value === null ? "" : String(value)}
        maxLength={1000}
        onChange={(event) => onChange(event.currentTarget.value)}
      />
    );
  return (
    <NumberInput
      {...shown}
      min={low ?? undefined}
      max={high ?? undefined}
      allowDecimal={kind === "number"}
      placeholder={usual === null ? undefined : String(usual)}
      defaultValue={typeof value === "number" ? value : ""}
      onChange={(given) => onChange(typeof given === "number" ? given : null)}
    />
  );
}
