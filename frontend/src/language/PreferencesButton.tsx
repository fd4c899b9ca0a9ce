import { ActionIcon, Popover, Tooltip } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { lazy, Suspense, useState } from "react";

import { IconLanguage } from "../ui/icons";

const PreferencesForm = lazy(async () => ({
  default: (await import("./PreferencesForm")).PreferencesForm,
}));

/** Opens what this reader has chosen; it stays open while choices are made. */
export function PreferencesButton() {
  const [open, setOpen] = useState(false);
  const words = t`Language and units`;
  return (
    <Popover opened={open} onChange={setOpen} position="bottom-end" trapFocus withArrow shadow="md">
      <Popover.Target>
        <Tooltip label={words} disabled={open}>
          <ActionIcon
            variant="subtle"
            color="gray"
            size="lg"
            aria-label={words}
            aria-expanded={open}
            onClick={() => setOpen(!open)}
          >
            <IconLanguage />
          </ActionIcon>
        </Tooltip>
      </Popover.Target>
      <Popover.Dropdown aria-label={words}>
        <Suspense fallback={null}>
          <PreferencesForm />
        </Suspense>
      </Popover.Dropdown>
    </Popover>
  );
}
