import type { FitRow } from "../api/runs";
import type { Mark } from "../map/scene";

/** Counts at one place, and whether all of them are met. */
export interface CountPlace {
  place: string;
  x: number;
  y: number;
  met: boolean;
}

/** Places of counting that are on the map; met only if each of their counts is. */
export function countPlaces(rows: readonly FitRow[]): CountPlace[] {
  const found = new Map<string, CountPlace>();
  for (const { place, x, y, met } of rows) {
    if (x === null || y === null) continue;
    const known = found.get(place);
    if (known) known.met &&= met;
    else found.set(place, { place, x, y, met });
  }
  return [...found.values()];
}

export const countMarks = (rows: readonly FitRow[]): Mark[] =>
  // Those that are not met last, so that they are drawn on top.
  countPlaces(rows).sort((a, b) => Number(b.met) - Number(a.met))
    .map(({ x, y, met }) => ({ x, y, kind: met ? "met" : "unmet", fresh: false }));

/** What is worst comes first. */
export const worstFirst = (rows: readonly FitRow[]): FitRow[] => [...rows].sort((a, b) => b.geh - a.geh);
