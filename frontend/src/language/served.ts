import { i18n, type MessageDescriptor } from "@lingui/core";

type Texts = Readonly<Record<string, MessageDescriptor>>;

/** What the server says in whole texts; none where the reader reads English. */
let texts: Texts = {};

/** Sets the texts that {@link served} knows. */
export const serveTexts = (known: Texts): void => {
  texts = known;
};

/** What finds sentences of the server and their place in the catalogue; none where the reader reads English. */
let sentences: ((text: string) => string) | null = null;

/** Sets, or with null takes away, what {@link served} asks for a text that no list has. */
export const serveSentences = (translated: ((text: string) => string) | null): void => {
  sentences = translated;
};

/** A text of the server in the language of the reader; one that is not known stays as it is. */
export function served(text: string): string {
  const known = texts[text];
  return known ? i18n._(known) : (sentences?.(text) ?? text);
}
