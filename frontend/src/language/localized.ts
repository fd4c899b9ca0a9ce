import { i18n } from "@lingui/core";

import { type Preferences, preferences } from "./preferences";

/**
 * A table with texts, made when it is first asked for and again after the reader has chosen another
 * language or unit. A plain constant would keep the texts of the moment at which it was loaded.
 */
export function localized<T>(make: () => T): () => T {
  let made: { locale: string; by: Preferences; value: T } | null = null;
  return () => {
    const by = preferences();
    if (made?.locale !== i18n.locale || made.by !== by) made = { locale: i18n.locale, by, value: make() };
    return made.value;
  };
}
