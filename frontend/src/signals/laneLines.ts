import type { DetectorLane } from "../api/signals";

/** A point on the lane before a light: its front end would lie so many metres before the stop line. */
export interface LoopPlace {
  at: string;
  before: number;
  /** Rear and front end, x and y in metres. */
  place: [number, number][];
}

type Point = readonly [number, number];

const away = ([x0, y0]: Point, [x1, y1]: Point): number => Math.hypot(x1 - x0, y1 - y0);

/** The nearest lane within `reach` metres of a point, and how far before its stop line that is. */
export function loopAt(
  lanes: readonly DetectorLane[],
  at: Point,
  reach: number,
  length: number,
): LoopPlace | null {
  let best: { lane: DetectorLane; before: number } | null = null;
  let least = reach;
  for (const lane of lanes) {
    const found = nearest(lane.line, at);
    if (found && found.away <= least) {
      least = found.away;
      best = { lane, before: found.before };
    }
  }
  return best && loopOn(best.lane, best.before, length);
}

/** A loop on a lane whose front end is so many metres before the stop line, to the half metre. */
export function loopOn({ at, line }: DetectorLane, before: number, length: number): LoopPlace {
  const front = Math.round(before * 2) / 2;
  return { at, before: front, place: [pointBefore(line, front + length), pointBefore(line, front)] };
}

/** Metres from the nearest point of a line to its end, and from there to the point. */
export function nearest(line: readonly Point[], to: Point): { before: number; away: number } | null {
  let best: { before: number; away: number } | null = null;
  let rest = 0;
  for (let n = line.length - 1; n > 0; n--) {
    const [a, b] = [line[n - 1], line[n]];
    if (!a || !b) continue;
    const whole = away(a, b);
    const [ux, uy] = [b[0] - a[0], b[1] - a[1]];
    const along = whole > 0 ? ((to[0] - a[0]) * ux + (to[1] - a[1]) * uy) / (whole * whole) : 0;
    const share = Math.min(1, Math.max(0, along));
    const off = away([a[0] + share * ux, a[1] + share * uy], to);
    if (!best || off < best.away) best = { before: rest + (1 - share) * whole, away: off };
    rest += whole;
  }
  return best;
}

/** The point so many metres before the end of a line; its begin if it is shorter. */
function pointBefore(line: readonly Point[], metres: number): [number, number] {
  let rest = metres;
  for (let n = line.length - 1; n > 0; n--) {
    const [a, b] = [line[n - 1], line[n]];
    if (!a || !b) continue;
    const whole = away(a, b);
    if (rest <= whole) {
      const share = whole > 0 ? rest / whole : 0;
      return [b[0] + share * (a[0] - b[0]), b[1] + share * (a[1] - b[1])];
    }
    rest -= whole;
  }
  const [x, y] = line[0] ?? [0, 0];
  return [x, y];
}
