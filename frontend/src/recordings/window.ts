import type { RecordedScene } from "../api/recordings";

/** A part of a recording, seconds as it counts them. */
export interface Part {
  begin: number;
  end: number;
}

/** Seconds before and after a scene that a scenario of it has. */
export const BEFORE = 5;
export const AFTER = 5;
/** Nothing shorter is a scenario, seconds. */
export const SHORTEST = 1;

const within = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));

/** The part around a scene. */
export const partOf = ({ begin, end }: RecordedScene, whole: Part): Part => ({
  begin: Math.max(whole.begin, begin - BEFORE),
  end: Math.min(whole.end, end + AFTER),
});

/** The part between two instants in either order, at least as long as a scenario may be. */
export function partBetween(a: number, b: number, whole: Part): Part {
  const begin = within(Math.min(a, b), whole.begin, Math.max(whole.begin, whole.end - SHORTEST));
  return { begin, end: within(Math.max(a, b), Math.min(begin + SHORTEST, whole.end), whole.end) };
}

/** The part with one of its ends moved. */
export const movedEnd = (part: Part, end: "begin" | "end", to: number, whole: Part): Part =>
  end === "begin"
    ? { ...part, begin: within(to, whole.begin, part.end - SHORTEST) }
    : { ...part, end: within(to, part.begin + SHORTEST, whole.end) };
