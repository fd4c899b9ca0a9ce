import { NativeSelect, Stack, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { languageChoices } from "./load";
import { ALLOWED, prefer, usePreferences } from "./preferences";

/** Language and units of the page; documents keep their m/s and metres. */
export function PreferencesForm() {
  const { language, speed, length, hours } = usePreferences();
  return (
    <Stack gap="sm">
      <NativeSelect
        label={t`Language`}
        data={languageChoices()}
        value={language}
        onChange={({ currentTarget }) => choose("language", currentTarget.value)}
      />
      <NativeSelect
        label={t`Speeds in`}
        data={[...ALLOWED.speed]}
        value={speed}
        onChange={({ currentTarget }) => choose("speed", currentTarget.value)}
      />
      <NativeSelect
        label={t`Lengths in`}
        data={[
          { value: "m", label: t`metres` },
          { value: "ft", label: t`feet` },
        ]}
        value={length}
        onChange={({ currentTarget }) => choose("length", currentTarget.value)}
      />
      <NativeSelect
        label={t`Times of day in`}
        data={[
          { value: "24", label: t`24 hours` },
          { value: "12", label: t`12 hours` },
        ]}
        value={String(hours)}
        onChange={({ currentTarget }) => choose("hours", currentTarget.value)}
      />
      <Text size="xs" c="dimmed">
        <Trans>They are kept in this browser; files and reports stay as they are.</Trans>
      </Text>
    </Stack>
  );
}

function choose(key: keyof typeof ALLOWED, text: string): void {
  const value = ALLOWED[key].find((one) => String(one) === text);
  if (value !== undefined) prefer({ [key]: value });
}
