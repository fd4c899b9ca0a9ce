import {
  createTheme,
  type CSSVariablesResolver,
  Loader,
  Modal,
  ModalHeader,
  NumberInput,
} from "@mantine/core";
import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import { decimalSign } from "../language/numbers";

export const theme = localized(() =>
  createTheme({
    primaryColor: "blue",
    primaryShade: 8,
    fontFamily: "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif",
    defaultRadius: "md",
    autoContrast: true,
    cursorType: "pointer",
    // Folds and dialogues of the library move by script, which the style sheet cannot stop.
    respectReducedMotion: true,
    components: {
      // Without a role its label is not read.
      Loader: Loader.extend({ defaultProps: { role: "status" } }),
      Modal: Modal.extend({ defaultProps: { closeButtonProps: { "aria-label": t`Close` } } }),
      // A window's head is not a second head of the page.
      ModalHeader: ModalHeader.extend({ defaultProps: { role: "presentation" } }),
      // A point may be typed, too, where a comma is shown.
      NumberInput: NumberInput.extend({
        defaultProps: { decimalSeparator: decimalSign(), allowedDecimalSeparators: [".", ","] },
      }),
    },
  }),
);

/** Secondary text and light alerts with a contrast of 4.5 at least, which Mantine's own colours miss. */
export const contrast: CSSVariablesResolver = () => ({
  variables: {},
  light: {
    "--mantine-color-dimmed": "var(--mantine-color-gray-7)",
    "--mantine-color-blue-light-color": "var(--mantine-color-blue-9)",
    "--mantine-color-red-light-color": "var(--mantine-color-red-9)",
  },
  dark: { "--mantine-color-dimmed": "var(--mantine-color-dark-1)" },
});
