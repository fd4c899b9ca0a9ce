import { i18n } from "@lingui/core";

import { SERVER_TEXTS } from "./serverTexts";

/** What finds sentences of the server and their place in the catalogue; none where the reader reads English. */
let sentences: ((text: string) => string) | null = null;

/** Sets, or with null takes away, what {@link served} asks for a text that no list has. */
export const serveSentences = (translated: ((text: string) => string) | null): void => {
  sentences = translated;
};

/** What loads their catalogue when the first of them is to be shown. */
let wanted: (() => void) | null = null;

/** Sets, or with null takes away, what is called with the first text that no list has. */
export const whenServed = (load: (() => void) | null): void => {
  wanted = load;
};

/** A text of the server in the language of the reader; one that is not known stays as it is. */
export function served(text: string): string {
  const known = SERVER_TEXTS[text];
  if (known) return i18n._(known);
  wanted?.();
  wanted = null;
  return sentences?.(text) ?? text;
}
