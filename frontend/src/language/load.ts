import { i18n, type Messages } from "@lingui/core";
import { compileMessage } from "@lingui/message-utils/compileMessage";

import { followOtherTabs, type Language, LANGUAGES, usePreferences } from "./preferences";
import { serveSentences, serveTexts } from "./served";

/** The catalogues, each loaded when its language is first chosen; English texts come with the code. */
const CATALOGUES: Record<Language, () => Promise<{ messages: Messages }>> = {
  en: () => Promise.resolve({ messages: {} }),
  de: () => import("../locales/de.po"),
};

/** Milliseconds after the first view is shown until sentences of the server are loaded. */
const AFTER_VIEW = 800;

let viewIsShown: () => void;
const firstView = new Promise<void>((resolve) => (viewIsShown = resolve));

/** A view is on the screen: what it does not need may be loaded. */
export const noteViewShown = (): void => viewIsShown();

/** Catalogues of these sentences; as the server sends them, they are English. */
const SENTENCES: Record<Language, (() => Promise<{ messages: Messages }>) | null> = {
  en: null,
  de: () => import("../locales/server/de.po"),
};

/** Compiled as they are first shown; the catalogue of English would be more than a tenth of the first load. */
const compiled = new Map<string, ReturnType<typeof compileMessage>>();

i18n.setMessagesCompiler((message) => {
  let known = compiled.get(message);
  if (!known) compiled.set(message, (known = compileMessage(message)));
  return known;
});

/** Shows the page in a language; what is shown changes when its catalogue is there. */
async function speak(language: Language): Promise<void> {
  const { messages } = await CATALOGUES[language]();
  // Another may have been chosen meanwhile.
  if (usePreferences.getState().language !== language) return;
  serveSentences(null);
  i18n.loadAndActivate({ locale: language, messages });
  document.documentElement.lang = language;
  // Not counted from here: on a slow machine the view would wait for these sentences.
  void firstView.then(() => {
    // Where it cannot be had, sentences stay as the server says them.
    setTimeout(() => void speakForServer(language).catch(() => undefined), AFTER_VIEW);
  });
}

/** Has what the server says in a language, too. */
async function speakForServer(language: Language): Promise<void> {
  const load = SENTENCES[language];
  if (!load) return;
  const [{ messages }, { translated }, { SERVER_TEXTS }] = await Promise.all([
    load(),
    import("./sentences"),
    import("./serverTexts"),
  ]);
  if (usePreferences.getState().language !== language) return;
  serveTexts(SERVER_TEXTS);
  serveSentences(translated);
  i18n.load(language, messages);
}

/** Loads the language of this reader, and follows their choice from then on. */
export async function startSpeaking(): Promise<void> {
  usePreferences.subscribe(({ language }, before) => {
    if (language !== before.language) void speak(language);
  });
  followOtherTabs();
  await speak(usePreferences.getState().language);
}

export const languageChoices = (): { value: Language; label: string }[] =>
  (Object.keys(LANGUAGES) as Language[]).map((value) => ({ value, label: LANGUAGES[value] }));
