import { i18n } from "@lingui/core";

// The texts of the code, without a catalogue.
i18n.loadAndActivate({ locale: "en", messages: {} });

// The address of the page, which tests outside a browser have not.
globalThis.location ??= new URL("http://odscen.test/") as unknown as Location;
