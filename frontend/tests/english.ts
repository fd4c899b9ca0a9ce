import { i18n } from "@lingui/core";

// The texts of the code, without a catalogue.
i18n.loadAndActivate({ locale: "en", messages: {} });
