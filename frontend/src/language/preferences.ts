import { create } from "zustand";

/** The languages of the page, each called as its speakers call it. */
export const LANGUAGES = { en: "English", de: "Deutsch" } as const;
export type Language = keyof typeof LANGUAGES;

/** How a reader wants to see the page; documents, files and the server know nothing of it. */
export interface Preferences {
  language: Language;
  speed: "km/h" | "mph" | "m/s";
  length: "m" | "ft";
  hours: 24 | 12;
}

const DEFAULT: Preferences = { language: "en", speed: "km/h", length: "m", hours: 24 };
/** The choices that there are. */
export const ALLOWED: { readonly [K in keyof Preferences]: readonly Preferences[K][] } = {
  language: Object.keys(LANGUAGES) as Language[],
  speed: ["km/h", "mph", "m/s"],
  length: ["m", "ft"],
  hours: [24, 12],
};
const KEY = "odscen.preferences";

/** The first of a reader's languages that the page has. */
const spoken = (wanted: readonly string[]): Language =>
  wanted.map((tag) => ALLOWED.language.find((language) => tag.split("-")[0] === language)).find(Boolean) ??
  DEFAULT.language;

/** What this browser remembers; what is not known any more is as at first, in the first of its languages. */
export function read(kept: string | null, languages: readonly string[] = []): Preferences {
  let found: Partial<Record<keyof Preferences, unknown>>;
  try {
    found = (JSON.parse(kept ?? "{}") ?? {}) as typeof found;
  } catch {
    found = {};
  }
  const first: Preferences = { ...DEFAULT, language: spoken(languages) };
  const one = <K extends keyof Preferences>(key: K): Preferences[K] =>
    ALLOWED[key].find((value) => value === found[key]) ?? first[key];
  return { language: one("language"), speed: one("speed"), length: one("length"), hours: one("hours") };
}

function remembered(): string | null {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

export const usePreferences = create<Preferences>(() => read(remembered(), navigator.languages));

/** The preferences now, for what is no component. */
export const preferences = (): Preferences => usePreferences.getState();

let chosen = true;
/** Whether they were last changed in this tab, which then begins anew; else it keeps what is open in it. */
export const chosenHere = (): boolean => chosen;

/** Changes some of them, and remembers them where the browser lets. */
export function prefer(changed: Partial<Preferences>): void {
  chosen = true;
  usePreferences.setState(changed);
  try {
    localStorage.setItem(KEY, JSON.stringify(preferences()));
  } catch {
    // They hold until the page is closed.
  }
}

/** Takes over what another tab of this browser prefers, as soon as it does. */
export function followOtherTabs(): void {
  addEventListener("storage", ({ key, newValue }) => {
    if (key !== KEY) return;
    chosen = false;
    usePreferences.setState(read(newValue, navigator.languages));
  });
}
