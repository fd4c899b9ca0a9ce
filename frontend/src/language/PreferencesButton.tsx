import { ActionIcon, Modal, Tooltip } from "@mantine/core";
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
    <>
      <Tooltip label={words}>
        <ActionIcon variant="subtle" color="gray" size="lg" aria-label={words} onClick={() => setOpen(true)}>
          <IconLanguage />
        </ActionIcon>
      </Tooltip>
      <Modal opened={open} onClose={() => setOpen(false)} title={words} size="sm" centered>
        <Suspense fallback={null}>
          <PreferencesForm />
        </Suspense>
      </Modal>
    </>
  );
}
