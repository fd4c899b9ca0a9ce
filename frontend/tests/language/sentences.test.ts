import { readFileSync } from "node:fs";
import { join } from "node:path";

import { i18n } from "@lingui/core";
import { compileMessage } from "@lingui/message-utils/compileMessage";
import { afterAll, beforeAll, expect, test } from "vitest";

import { partsOf, translated } from "../../src/language/sentences";
import { served, serveSentences, serveTexts } from "../../src/language/served";
import { SERVER_SENTENCES } from "../../src/language/serverSentences";
import { SERVER_TEXTS } from "../../src/language/serverTexts";
import { messages as page } from "../../src/locales/de.po";
import { messages as server } from "../../src/locales/server/de.po";

beforeAll(() => {
  i18n.setMessagesCompiler(compileMessage);
  i18n.loadAndActivate({ locale: "de", messages: { ...page, ...server } });
});
afterAll(() => i18n.loadAndActivate({ locale: "en", messages: {} }));

/** Texts of a catalogue by those of the code, as the file has them. */
function catalogue(path: string): Map<string, string> {
  const text = readFileSync(join(__dirname, "../../src/locales", path), "utf8");
  const pairs = text.matchAll(/^msgid (".*")\nmsgstr (".*")$/gm);
  return new Map([...pairs].map(([, id, said]) => [JSON.parse(id ?? ""), JSON.parse(said ?? "")]));
}

const GERMAN = catalogue("server/de.po");
const messages = SERVER_SENTENCES.map(({ message }) => message ?? "");
const namesOf = (message: string): string[] => partsOf(message).filter((_, n) => n % 2 === 1);
const put = (message: string, value: (name: string) => string): string =>
  partsOf(message)
    .map((part, n) => (n % 2 ? value(part) : part))
    .join("");
/** What is inserted at once after another value begins as a sentence does that goes on another. */
const follows = (message: string, name: string): boolean => message.includes(`}{${name}}`);
/** Lines of tables are numbers, whatever else is tried. */
const isLine = (message: string, name: string): boolean =>
  message.includes(`line {${name}}`) && /^(number|line_num|lineno|lines)$/.test(name);
test("each sentence of the server is in the catalogue, and each inserts in German what it does in English", () => {
  expect(messages.length).toBeGreaterThan(1000);
  for (const message of messages) {
    const german = GERMAN.get(message) ?? "";
    expect(german, message).not.toBe("");
    expect(namesOf(german).sort(), message).toEqual(namesOf(message).sort());
  }
});

test.each([
  ["ids", (n: number) => `'x${n}'`],
  ["numbers", (n: number) => `${n}234`],
])("each sentence is found again, whatever it inserts: %s", (kind, say) => {
  const wrong = messages.flatMap((message) => {
    const names = namesOf(message);
    const value = (name: string): string => {
      if (isLine(message, name)) return "7";
      return follows(message, name) ? "; 'x'" : say(names.indexOf(name) + 1);
    };
    const [text, expected] = [put(message, value), put(GERMAN.get(message) ?? "", value)];
    // Of buses, whose ids are always in quotes; with a number it would be one of a table.
    if (kind === "numbers" && message === "line {id}") return [];
    const found = translated(text);
    return found === expected ? [] : [`${text}\n  ${found}\n  ${expected}`];
  });
  expect(wrong).toEqual([]);
});

test.each([
  // A name that is not known, with a hint; the kind of thing is a word of the server.
  ["no map named 'Twon'; did you mean Town?", "Karte 'Twon' gibt es nicht; ist Town gemeint?"],
  // The place in a file stays, as it is what one looks for in the file.
  [
    "Town.xodr: road 7 > laneSection 0 > lane -1: width at s=12.5 is -0.3 m",
    "Town.xodr: road 7 > laneSection 0 > lane -1: die Breite bei s=12,5 ist -0,3 m",
  ],
  // Several lines.
  [
    "run7: 2 files are not as written; build it anew\n  - a.json: expected sha256 1, found sha256 2",
    "run7: 2 Dateien sind nicht so, wie geschrieben; build it anew\n  - a.json: erwartet sha256 1, gefunden sha256 2",
  ],
  // Words of categories, in lists as well.
  [
    "'a' wants to go 70 m/s (252 km/h); plausible for a car are 1 to 55.6 m/s",
    "'a' soll 70 m/s (252 km/h) schnell sein; plausibel sind 1 bis 55,6 m/s (Pkw)",
  ],
  // Quoted ids in a list.
  [
    "'a' and 'b' start on the same node 'n'; move all but one",
    "'a' und 'b' starten auf demselben Knoten 'n'; alle bis auf einen verschieben",
  ],
  // What pydantic says of a document.
  [
    "actors[0].speed: Input should be greater than 0, not -3.5",
    "actors[0].speed: verlangt ist mehr als 0, nicht -3,5",
  ],
  ["there is nothing to undo", "es gibt nichts rückgängig zu machen"],
  ["Stage B in junction j1", "Phase B am Knotenpunkt j1"],
  // What is not known stays, as do words of other programs.
  ["Error: lane 'x_0' is not known.", "Error: lane 'x_0' is not known."],
])("%s", (text, german) => {
  expect(translated(text)).toBe(german);
});

test("a text of the server is looked up in the lists first, then among the sentences", () => {
  expect(served("there is nothing to undo")).toBe("there is nothing to undo");
  serveTexts(SERVER_TEXTS);
  serveSentences(translated);
  expect(served("there is nothing to undo")).toBe("es gibt nichts rückgängig zu machen");
  expect(served("Cut-in")).toBe("Einscheren");
  serveSentences(null);
});
