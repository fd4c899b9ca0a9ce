import { expect, test } from "vitest";

import { panned, type Sight, snapped, snapStep, ticksOf, toTime, toX, zoomed } from "../../src/time/sight";

const SIGHT: Sight = { begin: 20, seconds: 80, width: 400 };

test("an instant has a place, and a place its instant", () => {
  expect(toX(SIGHT, 20)).toBe(0);
  expect(toX(SIGHT, 60)).toBe(200);
  for (const time of [0, 20, 33.3, 99.9, 140]) expect(toTime(SIGHT, toX(SIGHT, time))).toBeCloseTo(time, 9);
});

test("zooming keeps the instant where it is, and what is in sight inside the run", () => {
  const closer = zoomed(SIGHT, 2, 60, 600);
  expect(closer).toEqual({ begin: 40, seconds: 40, width: 400 });
  expect(toX(closer, 60)).toBe(toX(SIGHT, 60));
  expect(zoomed(SIGHT, 0.01, 60, 600)).toEqual({ begin: 0, seconds: 600, width: 400 });
  expect(zoomed(SIGHT, 1000, 60, 600).seconds).toBe(2);
  expect(panned(SIGHT, 1000, 600).begin).toBe(520);
  expect(panned(SIGHT, -1000, 600).begin).toBe(0);
});

test("a drag snaps to round steps of some pixels", () => {
  expect(snapStep({ begin: 0, seconds: 600, width: 600 })).toBe(5);
  expect(snapStep({ begin: 0, seconds: 60, width: 900 })).toBe(0.5);
  expect(snapStep({ begin: 0, seconds: 10, width: 900 })).toBe(0.1);
  expect(snapped(12.34, 0.1)).toBe(12.3);
  expect(snapped(12.34, 5)).toBe(10);
});

test("ticks are round and in sight", () => {
  expect(ticksOf(SIGHT)).toEqual([20, 40, 60, 80, 100]);
  expect(ticksOf({ begin: 0, seconds: 600, width: 900 })).toEqual([
    0, 60, 120, 180, 240, 300, 360, 420, 480, 540, 600,
  ]);
  expect(ticksOf({ begin: 3, seconds: 4, width: 300 })).toEqual([3, 4, 5, 6, 7]);
});
