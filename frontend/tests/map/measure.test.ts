import { afterEach, expect, test } from "vitest";

import { areaText, measuredLength } from "../../src/language/units";
import { prefer } from "../../src/language/preferences";
import {
  area,
  length,
  type Measured,
  NOTHING,
  type Point,
  sides,
  withoutLast,
  withPoint,
} from "../../src/map/measure";

afterEach(() => prefer({ length: "m" }));

const REACH = 1;
const through = (...points: Point[]): Measured =>
  points.reduce<Measured>((measured, point) => withPoint(measured, point, REACH), NOTHING);
const SQUARE: Point[] = [
  [10, 20],
  [40, 20],
  [40, 60],
  [10, 60],
];

test("a line is as long as its sides, and has no area", () => {
  const line = through(...SQUARE);
  expect(sides(line).map(({ metres }) => metres)).toEqual([30, 40, 30]);
  expect(length(line)).toBe(100);
  expect(area(line)).toBe(0);
});

test("a point on the first one goes around an area, whichever way", () => {
  for (const corners of [SQUARE, [...SQUARE].reverse()]) {
    const [first] = corners as [Point];
    const round = through(...corners, [first[0] + 0.5, first[1]]);
    expect(round.closed).toBe(true);
    expect(round.points).toHaveLength(4);
    expect([length(round), area(round)]).toEqual([140, 1200]);
  }
});

test("two points go around nothing: the way back is one more side", () => {
  const there = through([0, 0], [8, 0], [0, 0]);
  expect(there.closed).toBe(false);
  expect(length(there)).toBe(16);
});

test("a point behind an area begins anew, and points are taken back one by one", () => {
  const round = through(...SQUARE, [10, 20]);
  expect(withPoint(round, [5, 5], REACH)).toEqual({ points: [[5, 5]], closed: false });
  const open = withoutLast(round);
  expect([open.closed, open.points.length]).toEqual([false, 4]);
  expect(withoutLast(open).points).toEqual(SQUARE.slice(0, 3));
  expect(withoutLast(NOTHING)).toEqual(NOTHING);
});

test("lengths and areas are in the reader's unit, and in a larger one where they are large", () => {
  expect([12.34, 250.4, 1234.5].map(measuredLength)).toEqual(["12.3 m", "250 m", "1.23 km"]);
  expect([80.4, 2_500_000].map(areaText)).toEqual(["80 m²", "2.50 km²"]);
  prefer({ length: "ft" });
  expect([3.048, 304.8, 1609.344].map(measuredLength)).toEqual(["10.0 ft", "1000 ft", "1.00 mi"]);
  expect([9.290304, 8093.7128448].map(areaText)).toEqual(["100 ft²", "2.00 ac"]);
});
