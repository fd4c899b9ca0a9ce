// @vitest-environment happy-dom
import { i18n } from "@lingui/core";
import { expect, test, vi } from "vitest";

import { startSpeaking } from "../../src/language/load";
import { prefer, preferences } from "../../src/language/preferences";

const KEY = "odscen.preferences";
const changed = (key: string | null, newValue: string | null): boolean =>
  dispatchEvent(new StorageEvent("storage", { key, newValue }));

test("what is preferred in another tab is shown in this one, too", async () => {
  prefer({ language: "en" });
  await startSpeaking();
  changed(KEY, JSON.stringify({ language: "de", speed: "mph" }));
  expect(preferences()).toMatchObject({ language: "de", speed: "mph", length: "m" });
  await vi.waitFor(() => expect(document.documentElement.lang).toBe("de"));
  expect(i18n.locale).toBe("de");
  changed("another", JSON.stringify({ language: "en" }));
  changed(null, null);
  expect(preferences().language).toBe("de");
  changed(KEY, JSON.stringify({ language: "en" }));
  await vi.waitFor(() => expect(document.documentElement.lang).toBe("en"));
  expect(preferences()).toMatchObject({ language: "en", speed: "km/h" });
});
