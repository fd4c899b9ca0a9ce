import type { FitRow } from "../api/runs";
import type { Mark } from "../map/scene";

/** Counts at one station, and whether all of them are met. */
export interface CountStation {
  place: string;
  x: number;
  y: number;
  met: boolean;
}

/** Count stations that are on the map; met only if each of their counts is. */
export function countStations(rows: readonly FitRow[]): CountStation[] {
  const found = new Map<string, CountStation>();
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
  countStations(rows)
    .sort((a, b) => Number(b.met) - Number(a.met))
    .map(({ x, y, met }) => ({ x, y, kind: met ? "met" : "unmet", fresh: false }));

/** The worst first. */
export const worstFirst = (rows: readonly FitRow[]): FitRow[] => [...rows].sort((a, b) => b.geh - a.geh);
