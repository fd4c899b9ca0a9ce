import { i18n } from "@lingui/core";

import { SERVER_TEXTS } from "./serverTexts";

/** A text of the server in the language of the reader; one that no list has stays as it is. */
export function served(text: string): string {
  const known = SERVER_TEXTS[text];
  return known ? i18n._(known) : text;
}
