import { nth } from "../lists";

type Points = readonly (readonly [number, number])[];

/** The leg of a route that is nearest to a point, and how far it is, metres; null without legs. */
export function nearestLeg(
  legs: readonly Points[],
  x: number,
  y: number,
): { leg: number; away: number } | null {
  let best: { leg: number; away: number } | null = null;
  legs.forEach((points, leg) => {
    for (let k = 0; k + 1 < points.length; k++) {
      const away = fromPiece(nth(points, k), nth(points, k + 1), x, y);
      if (best === null || away < best.away) best = { leg, away };
    }
  });
  return best;
}

/** Distance of a point from a straight piece. */
function fromPiece(
  [x0, y0]: readonly [number, number],
  [x1, y1]: readonly [number, number],
  x: number,
  y: number,
): number {
  const [dx, dy] = [x1 - x0, y1 - y0];
  const square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / square)) : 0;
  return Math.hypot(x - x0 - share * dx, y - y0 - share * dy);
}

/** The waypoints with another one before that at `index`, or in its place; no place twice in a row. */
export function withWaypoint(via: readonly string[], index: number, id: string, replaces: boolean): string[] {
  const next = [...via.slice(0, index), id, ...via.slice(replaces ? index + 1 : index)];
  return next.filter((one, n) => one !== next[n - 1]);
}
