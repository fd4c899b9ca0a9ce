import "@mantine/core/styles.css";
import "./ui/app.css";
import "./ui/narrow.css";

import { i18n } from "@lingui/core";
import { I18nProvider } from "@lingui/react";
import { createRoot } from "react-dom/client";

import { Page } from "./Page";
import { startSpeaking } from "./language/load";

const root = document.getElementById("root");
if (root) {
  const shown = createRoot(root);
  const show = (): void =>
    shown.render(
      <I18nProvider i18n={i18n}>
        <Page />
      </I18nProvider>,
    );
  void startSpeaking().then(show);
}
