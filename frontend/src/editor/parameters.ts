import { plural, t } from "@lingui/core/macro";

import type { ScenarioDocument } from "../api/types";

export type Parameter = ScenarioDocument["parameters"][string];

/** A number of the document that a formula can stand for; null where there is none yet. */
export interface DocumentNumber {
  /** As the server names it, `rules/cut-in/when/ttc/below`. */
  place: string;
  label: string;
  value: number | null;
}

/** A number that is computed. */
export interface ComputedNumber {
  place: string;
  label: string;
  formula: string;
}

type Swept = Pick<ScenarioDocument, "actors" | "flows" | "rules" | "simulation">;

const ROOTS = ["actors", "flows", "rules", "simulation"] as const;
/** Numbers of an actor that may be given where none is. */
const OPTIONAL = new Set(["speed", "initial_speed"]);

const escaped = (key: string): string => key.replaceAll("~", "~0").replaceAll("/", "~1");
const unescaped = (key: string): string => key.replaceAll("~1", "/").replaceAll("~0", "~");

/** All numbers of road users, flows, rules and of the run, by their places. */
export function numbersOf(document: Swept): DocumentNumber[] {
  const found: DocumentNumber[] = [];
  const walk = (node: unknown, path: readonly string[]): void => {
    const key = path.at(-1) ?? "";
    if (typeof node === "number" || (node === null && path[0] === "actors" && OPTIONAL.has(key))) {
      const place = path.map(escaped).join("/");
      found.push({ place, label: placeLabel(place), value: node });
    } else if (Array.isArray(node)) {
      const names = partNames(node);
      node.forEach((one, n) => walk(one, [...path, names[n] ?? String(n)]));
    } else if (typeof node === "object" && node !== null) {
      for (const [name, one] of Object.entries(node)) walk(one, [...path, name]);
    }
  };
  for (const root of ROOTS) walk(document[root], [root]);
  return found;
}

/** What the parts of a list are called: by their ids where these are their own, else by number. */
function partNames(parts: readonly unknown[]): string[] {
  const ids = parts.map((one) =>
    typeof one === "object" && one !== null && "id" in one && typeof one.id === "string" ? one.id : null,
  );
  return ids.map((id, n) => (id !== null && ids.indexOf(id) === ids.lastIndexOf(id) ? id : String(n)));
}

/** A place in words: `van: initial speed`, `Rule cut-in: when ttc below`. */
export function placeLabel(place: string): string {
  const [root = "", first = "", ...rest] = place.split("/").map(unescaped);
  const words = (keys: readonly string[]): string =>
    keys.map((key) => (/^\d+$/.test(key) ? String(Number(key) + 1) : key.replaceAll("_", " "))).join(" ");
  if (root === "simulation") return t`Run: ${words([first, ...rest])}`;
  if (root === "parameters") return t`Parameter ${first}`;
  if (rest.length === 0) return `${words([root])}: ${words([first])}`;
  return root === "rules" ? t`Rule ${first}: ${words(rest)}` : `${first}: ${words(rest)}`;
}

/** Numbers that are computed from a parameter. */
export const usesOf = (formulas: Readonly<Record<string, string>>, name: string): ComputedNumber[] =>
  Object.entries(formulas)
    .filter(([, formula]) => new RegExp(`\\$${name}(?![A-Za-z0-9_])`).test(formula))
    .map(([place, formula]) => ({ place, formula, label: placeLabel(place) }));

/** Whose a place is: the id of an actor, a flow or a rule. */
export function ownerOf(place: string): { root: string; id: string } {
  const [root = "", id = ""] = place.split("/").map(unescaped);
  return { root, id };
}

/** A free name for a parameter that replaces this number. */
export function nameFor(place: string, taken: readonly string[]): string {
  const { root, id } = ownerOf(place);
  const key = unescaped(place.split("/").at(-1) ?? "");
  const said = root === "simulation" ? key : `${id}_${key}`;
  const plain = said.replaceAll(/[^A-Za-z0-9_]+/g, "_").replace(/^(?=\d)/, "p_") || "parameter";
  const free = (n: number): string => (n === 1 ? plain : `${plain}_${n}`);
  let n = 1;
  while (taken.includes(free(n))) n += 1;
  return free(n);
}

/** Whether this can be the name of a parameter. */
export const isName = (name: string): boolean => /^[A-Za-z_][A-Za-z0-9_]{0,63}$/.test(name);

/** Bounds to begin with: half and twice the value. */
export function boundsFor(value: number): [number, number] {
  if (value === 0) return [0, 10];
  const ends = [value / 2, value * 2].map((one) => Number(one.toPrecision(3)));
  return [Math.min(...ends), Math.max(...ends)];
}

/** A round step that makes about two hundred of a range. */
export function stepOf(low: number, high: number): number {
  const rough = (high - low) / 200;
  return rough > 0 ? Number((10 ** Math.floor(Math.log10(rough))).toPrecision(1)) : 1;
}

/** A number as a person writes it. */
export const shortNumber = (value: number): string => String(Number(value.toPrecision(6)));

export const parameterNote = (parameters: Readonly<Record<string, Parameter>>): string => {
  const names = Object.keys(parameters);
  return names.length === 0
    ? t`Variables and parameter sweeps`
    : plural(names.length, { one: "# parameter", other: "# parameters" });
};
