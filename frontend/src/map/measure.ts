import { nth } from "../lists";

export type Point = readonly [x: number, y: number];

/** What is measured on a map: points, metres, and whether they go around an area. */
export interface Measured {
  points: readonly Point[];
  closed: boolean;
}

export const NOTHING: Measured = { points: [], closed: false };

/** With one more point; on the first one it goes around an area, behind that it begins anew. */
export function withPoint({ points, closed }: Measured, point: Point, reach: number): Measured {
  const [first] = points;
  if (!first || closed) return { points: [point], closed: false };
  if (points.length > 2 && distance(first, point) <= reach) return { points, closed: true };
  return { points: [...points, point], closed: false };
}

/** Without the last point; what went around an area is open again first. */
export const withoutLast = ({ points, closed }: Measured): Measured =>
  closed ? { points, closed: false } : { points: points.slice(0, -1), closed: false };

/** The sides that are measured, each from a point to the next; the last may lead back to the first. */
export function sides({ points, closed }: Measured): { from: Point; to: Point; metres: number }[] {
  const [first] = points;
  const round = closed && first ? [...points, first] : points;
  return round.slice(1).map((to, n) => {
    const from = nth(round, n);
    return { from, to, metres: distance(from, to) };
  });
}

/** Metres along all sides. */
export const length = (measured: Measured): number =>
  sides(measured).reduce((sum, { metres }) => sum + metres, 0);

/** Square metres that are gone around; of sides that cross, what the shoelace formula says. */
export function area(measured: Measured): number {
  const twice = sides(measured).reduce((sum, { from, to }) => sum + from[0] * to[1] - to[0] * from[1], 0);
  return measured.closed ? Math.abs(twice) / 2 : 0;
}

const distance = (one: Point, other: Point): number => Math.hypot(other[0] - one[0], other[1] - one[1]);
