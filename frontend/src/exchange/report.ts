import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { ImportReport, ImportRow } from "../api/exchange";
import type { Bounds } from "../api/types";
import type { ScenePin } from "../map/scene";
import { sentence } from "../ui/words";
import { served } from "../language/served";

/** What may have become of an element, what matters most first. */
export const VERDICTS = ["refused", "approximated", "ignored", "taken"] as const;
export type Verdict = (typeof VERDICTS)[number];

export const TITLES = localized((): Record<Verdict, string> => ({
  refused: t`Not supported (affects behaviour)`,
  approximated: t`Imported approximately`,
  ignored: t`Without a counterpart here`,
  taken: t`Imported unchanged`,
}));

export const MEANING = localized((): Record<Verdict, string> => ({
  refused: t`The rest of the scenario is there; these parts do nothing.`,
  approximated: t`These act, but not exactly as the file says.`,
  ignored: t`odscen has no part for these. The scenario plays without them.`,
  taken: t`Nothing to do.`,
}));

export const SIGNS: Record<Verdict, string> = { refused: "!", approximated: "≈", ignored: "–", taken: "✓" };

/** An element of the file in words, and how many elements inside it share its reason. */
export interface Element {
  row: ImportRow;
  word: string;
  inside: number;
}

/** Elements with the same reason. */
export interface Reason {
  text: string;
  elements: Element[];
}

/** Tag of an element as words: `RelativeTargetSpeed` is a relative target speed. */
export function elementWord(xpath: string): string {
  const tag = (xpath.split("/").at(-1) ?? "").replace(/\[\d+\]$/, "");
  const words = tag.replace(/(?<=[a-z])(?=[A-Z])/g, " ").toLowerCase();
  return sentence(words);
}

const PLAIN = localized((): [RegExp, string][] => [
  [/^odscen has no part for it$/, t`There is nothing like this in a scenario of odscen`],
  [/^its value is put in where it is named$/, t`Its value was put in where the file names it`],
]);

/** A path through the file with its line, of which people need the last element only. */
const PATH = /\/OpenSCENARIO\S*\/(\w+)(?:\[\d+\])? \(line (\d+)\)/g;

export function plainReason(reason: string): string {
  if (!reason) return "";
  for (const [pattern, text] of PLAIN()) if (pattern.test(reason)) return text;
  const words = reason.replace(/^left out: /, "").replace(PATH, "$1 in line $2");
  return sentence(served(words));
}

/** Rows of one list by their reason, the commonest first; what lies in another row of it is counted there. */
export function grouped(rows: readonly ImportRow[]): Reason[] {
  const reasons = new Map<string, Element[]>();
  for (const row of rows) {
    const text = plainReason(row.reason);
    const found = reasons.get(text) ?? [];
    const last = found.at(-1);
    if (last?.row.file === row.file && row.xpath.startsWith(`${last.row.xpath}/`)) last.inside += 1;
    else found.push({ row, word: elementWord(row.xpath), inside: 0 });
    reasons.set(text, found);
  }
  const size = ({ elements }: Reason): number => elements.reduce((sum, { inside }) => sum + 1 + inside, 0);
  return [...reasons]
    .map(([text, elements]) => ({ text, elements }))
    .sort((one, other) => size(other) - size(one));
}

/** How often each kind of element occurs, the commonest first. */
export function kinds(rows: readonly ImportRow[]): [word: string, count: number][] {
  const found = new Map<string, number>();
  for (const { xpath } of rows) {
    const word = elementWord(xpath);
    found.set(word, (found.get(word) ?? 0) + 1);
  }
  return [...found].sort((one, other) => other[1] - one[1]);
}

export interface Spot {
  x: number;
  y: number;
}

/** The place on the map that an element is about, if that is known. */
export const spotOf = ({ x, y }: ImportRow): Spot | null => (x === null || y === null ? null : { x, y });

/** Pins for all places of what was not taken as it is: one each, with the worst that happened there. */
export function pinsOf(report: ImportReport, chosen: Spot | null): ScenePin[] {
  const pins = new Map<string, ScenePin & { count: number }>();
  for (const verdict of VERDICTS) {
    if (verdict === "taken") continue;
    for (const row of report[verdict]) {
      const spot = spotOf(row);
      if (!spot) continue;
      const key = `${spot.x} ${spot.y}`;
      const pin = pins.get(key) ?? { ...spot, sign: SIGNS[verdict], text: "", count: 0 };
      pin.count += 1;
      pin.text = pin.count === 1 ? `line ${row.line}` : t`${pin.count} elements`;
      pins.set(key, pin);
    }
  }
  if (chosen && !pins.has(`${chosen.x} ${chosen.y}`))
    pins.set("chosen", { ...chosen, sign: SIGNS.taken, text: "", count: 0 });
  return [...pins.values()].map(({ x, y, sign, text }) => {
    const here = chosen?.x === x && chosen.y === y;
    return { x, y, sign, text, ...(sign === SIGNS.refused ? {} : { rule: here ? "strong" : "weak" }) };
  });
}

/** Metres around the places that are shown at first. */
const MARGIN = 40;

/** A rectangle around places; null if there are none. */
export function around(spots: readonly Spot[]): Bounds | null {
  if (spots.length === 0) return null;
  const [xs, ys] = [spots.map(({ x }) => x), spots.map(({ y }) => y)];
  return [
    Math.min(...xs) - MARGIN,
    Math.min(...ys) - MARGIN,
    Math.max(...xs) + MARGIN,
    Math.max(...ys) + MARGIN,
  ];
}
