import type { MapDetails } from "../api/types";

/** A lamp on the map and its colour now. */
export interface Lamp {
  x: number;
  y: number;
  color: string;
}

const COLOR: Record<string, string> = {
  r: "#ff3b30",
  y: "#ffc400",
  u: "#ffc400",
  g: "#22c55e",
  G: "#22c55e",
};
const RANK = "GgyurR";

/** Colour of every signal: where one shows several movements, the one that may go most. */
export function lamps(map: MapDetails, states: ReadonlyMap<string, string>): Lamp[] {
  const letter = new Map<string, string>();
  for (const light of map.lights) {
    const state = states.get(light.id) ?? "";
    light.signals.forEach((signals, n) => {
      for (const id of signals) {
        const old = letter.get(id);
        if (old === undefined || rank(state[n]) < rank(old)) letter.set(id, state[n] ?? "");
      }
    });
  }
  return map.semantics.signals.flatMap(({ id, x, y }) => {
    const color = COLOR[letter.get(id) ?? ""];
    return color ? [{ x, y, color }] : [];
  });
}

const rank = (state: string | undefined): number => {
  const found = RANK.indexOf(state ?? "?");
  return found < 0 ? RANK.length : found;
};
