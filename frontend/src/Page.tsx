import { MantineProvider } from "@mantine/core";
import { useLingui } from "@lingui/react";

import { App } from "./App";
import { usePreferences } from "./language/preferences";
import { contrast, theme } from "./ui/theme";

/** The window in the language and the units of its reader. */
export function Page() {
  // Both are read by many modules that are no components: what is drawn is drawn anew.
  useLingui();
  usePreferences();
  return (
    <MantineProvider theme={theme()} cssVariablesResolver={contrast} defaultColorScheme="auto">
      <App />
    </MantineProvider>
  );
}
