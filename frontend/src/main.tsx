import "@mantine/core/styles.css";
import "./ui/app.css";
import "./ui/narrow.css";

import { MantineProvider } from "@mantine/core";
import { createRoot } from "react-dom/client";

import { App } from "./App";
import { contrast, theme } from "./ui/theme";

const root = document.getElementById("root");
if (root) {
  createRoot(root).render(
    <MantineProvider theme={theme} cssVariablesResolver={contrast} defaultColorScheme="auto">
      <App />
    </MantineProvider>,
  );
}
