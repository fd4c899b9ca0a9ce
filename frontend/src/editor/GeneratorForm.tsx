import { t } from "@lingui/core/macro";
import { Alert, Checkbox, NumberInput, Select, Text, TextInput } from "@mantine/core";

import {
  type Filler,
  type Generator,
  type GeneratorOption,
  generators,
  type OptionValue,
} from "../api/generators";
import { useLoaded } from "../ui/useLoaded";
import { served } from "../language/served";

const AT_RANDOM = "";

/** Who places the road users of a fill: at random, or a generator that is installed, with its options. */
export function GeneratorForm({
  filler,
  onChange,
}: {
  filler: Filler | null;
  onChange: (filler: Filler | null) => void;
}) {
  const offered = useLoaded(generators.all);
  if (!offered.value) return null;
  const chosen = offered.value.find(({ name }) => name === filler?.generator);
  return (
    <>
      <Select
        label={t`Placed by`}
        data={[
          { value: AT_RANDOM, label: t`Random` },
          ...offered.value.map(({ name }) => ({ value: name, label: t`Generator ${name}` })),
        ]}
        value={filler?.generator ?? AT_RANDOM}
        allowDeselect={false}
        onChange={(name) => onChange(name ? { generator: name, options: {} } : null)}
      />
      {filler && chosen && <Options generator={chosen} filler={filler} onChange={onChange} />}
    </>
  );
}

function Options({
  generator,
  filler,
  onChange,
}: {
  generator: Generator;
  filler: Filler;
  onChange: (filler: Filler) => void;
}) {
  if (generator.error)
    return (
      <Alert color="red" title={t`This generator cannot be used`}>
        {served(generator.error)}
      </Alert>
    );
  const change = (name: string, value: OptionValue | null): void => {
    const others = Object.entries(filler.options).filter(([other]) => other !== name);
    onChange({
      ...filler,
      options: Object.fromEntries(value === null ? others : [...others, [name, value]]),
    });
  };
  return (
    <>
      {generator.summary && (
        <Text size="sm" c="dimmed">
          {served(generator.summary)}
        </Text>
      )}
      {generator.options.map((option) => (
        <OptionField
          key={option.name}
          option={option}
          value={filler.options[option.name] ?? option.usual}
          onChange={(value) => change(option.name, value)}
        />
      ))}
    </>
  );
}

/** One option: `null` is its usual value. */
function OptionField({
  option: { kind, title, meaning, low, high, choices },
  value,
  onChange,
}: {
  option: GeneratorOption;
  value: OptionValue | null;
  onChange: (value: OptionValue | null) => void;
}) {
  const shown = { label: title, description: meaning || undefined };
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
      value={typeof value === "number" ? value : ""}
      onChange={(given) => onChange(typeof given === "number" ? given : null)}
    />
  );
}
