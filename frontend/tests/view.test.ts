import { expect, test } from "vitest";

import { clampTo, fit, panBy, toScreen, toWorld, visible, zoomAt } from "../src/map/view";
import { roundLength } from "../src/language/units";

const size = { width: 800, height: 600 };
const view = { x: 12.5, y: -40, scale: 3.2 };

test("a place on the screen is the place on the map that is drawn there", () => {
  const [sx, sy] = toScreen(view, size, 101.25, -7.5);
  const [x, y] = toWorld(view, size, sx, sy);
  expect(x).toBeCloseTo(101.25, 9);
  expect(y).toBeCloseTo(-7.5, 9);
});

test("north is up", () => {
  expect(toScreen(view, size, 0, 10)[1]).toBeLessThan(toScreen(view, size, 0, 0)[1]);
});

test("zooming keeps the place under the pointer", () => {
  const before = toWorld(view, size, 700, 90);
  const after = toWorld(zoomAt(view, size, 2.5, 700, 90, 0.01), size, 700, 90);
  expect(after[0]).toBeCloseTo(before[0], 9);
  expect(after[1]).toBeCloseTo(before[1], 9);
});

test("zooming stops at both ends", () => {
  expect(zoomAt(view, size, 1e6, 0, 0, 0.5).scale).toBe(80);
  expect(zoomAt(view, size, 1e-6, 0, 0, 0.5).scale).toBe(0.5);
});

test("the whole map fits with its margin", () => {
  const bounds = [-100, -20, 300, 80] as const;
  const seen = visible(fit([...bounds], size), size);
  expect(seen[0]).toBeLessThan(bounds[0]);
  expect(seen[3]).toBeGreaterThan(bounds[3]);
});

test("dragging to the right moves the map to the right", () => {
  expect(panBy(view, 32, 0).x).toBeCloseTo(view.x - 10);
});

test("the view does not get lost beside the map", () => {
  expect(clampTo({ x: 999, y: -999, scale: 1 }, [0, 0, 10, 20])).toEqual({ x: 10, y: 0, scale: 1 });
});

test("the scale bar has a round length that fits", () => {
  for (const scale of [0.03, 0.7, 1, 3.3, 60]) {
    const bar = roundLength(110 / scale).metres;
    expect(bar * scale).toBeLessThanOrEqual(110);
    expect(String(bar)).toMatch(/^(0\.0*)?[125]0*$/);
  }
});
