import { BufferAttribute, PerspectiveCamera, Vector2, Vector3 } from "three";
import { describe, expect, test } from "vitest";

import { toScreen } from "../../src/map/view";
import { above, ANGLE, behind, type Carried, seat } from "../../src/scenery/cameras";
import { divided, strokes, surface, tiles } from "../../src/scenery/ground";
import { Heights } from "../../src/scenery/heights";
import { Sharpness } from "../../src/scenery/sharpness";
import { skyOf } from "../../src/scenery/weather";

const NO_WALKS = { x: [], y: [], hdg: [] } as never;

/** Nodes every two metres of a lane to the east whose height is given by x, and of one that crosses above. */
function heightsOf(rise: (x: number) => number, bridge: number | null): Heights {
  const [x, y, hdg, z]: number[][] = [[], [], [], []];
  for (let s = 0; s <= 100; s += 2) {
    x?.push(s);
    y?.push(0);
    hdg?.push(0);
    z?.push(rise(s));
  }
  if (bridge !== null)
    for (let s = -30; s <= 30; s += 2) {
      x?.push(50);
      y?.push(s);
      hdg?.push(Math.PI / 2);
      z?.push(bridge);
    }
  const columns = { x, y, hdg, walks: NO_WALKS } as never;
  return new Heights(columns, { z: z ?? [], walks: [] });
}

describe("heights", () => {
  test("on a slope they are those of the map, beside a lane and between its nodes too", () => {
    const heights = heightsOf((x) => 12 + 0.05 * x, null);
    for (const [x, y] of [
      [31, 0],
      [40.7, 1.75],
      [99.5, -1.75],
      [0.3, 3],
    ] as const)
      expect(heights.at(x, y)).toBeCloseTo(12 + 0.05 * x, 2);
    expect(heights.plane(50, 0).east).toBeCloseTo(0.05, 3);
    expect(heights.plane(50, 0).north).toBeCloseTo(0, 6);
  });

  test("over a summit they differ by centimetres", () => {
    const rise = (x: number): number => 5 - ((x - 50) * (x - 50)) / 2000;
    const heights = heightsOf(rise, null);
    for (let x = 5; x < 95; x += 3.3) expect(Math.abs(heights.at(x, 1.75) - rise(x))).toBeLessThan(0.03);
  });

  test("of two roads above each other the level, or the direction, says which", () => {
    const heights = heightsOf(() => 0, 6);
    expect(heights.at(50, 0)).toBeCloseTo(0, 6);
    expect(heights.at(50, 0, { level: 1 })).toBeCloseTo(6, 6);
    expect(heights.at(50, 0, { hdg: 0 })).toBeCloseTo(0, 6);
    expect(heights.at(50, 0, { hdg: Math.PI / 2 })).toBeCloseTo(6, 6);
    expect(heights.at(50, 25, { level: 0 })).toBeCloseTo(6, 6);
  });

  test("walks beside a road do not raise it, and those apart have their own height", () => {
    const walks = { x: [10, 12, 10], y: [3, 3, 80], hdg: [0, 0, 0] };
    const lane = { x: [8, 10, 12, 14], y: [0, 0, 0, 0], hdg: [0, 0, 0, 0] };
    const heights = new Heights({ ...lane, walks } as never, { z: [1, 1, 1, 1], walks: [1.12, 1.12, 4] });
    expect(heights.at(11, 1.75)).toBeCloseTo(1, 9);
    expect(heights.at(10, 80)).toBeCloseTo(4, 9);
  });

  test("a flat map has none, and no slope", () => {
    const flat = new Heights({ x: [0], y: [0], hdg: [0], walks: NO_WALKS } as never, { z: [], walks: [] });
    expect(flat.flat).toBe(true);
    expect(flat.plane(3, 4)).toEqual({ z: 0, east: 0, north: 0 });
  });
});

test("from straight above, places are where the plan has them, within a pixel", () => {
  const size = { width: 1200, height: 700 };
  for (const view of [
    { x: 40, y: -10, scale: 6 },
    { x: -300, y: 120, scale: 0.8 },
  ]) {
    const camera = new PerspectiveCamera(ANGLE.above, size.width / size.height, 0.4, 6000);
    camera.up.set(0, 0, 1);
    const { eye, target } = above([view.x, view.y, 0], view.scale, size.height, 0);
    camera.position.set(...eye);
    camera.lookAt(...target);
    camera.updateMatrixWorld();
    for (const [dx, dy] of [
      [0, 0],
      [50, 30],
      [-80, 40],
      [90, -55],
    ] as const) {
      const seen = new Vector3(view.x + dx, view.y + dy, 0).project(camera);
      const [px, py] = [((seen.x + 1) / 2) * size.width, ((1 - seen.y) / 2) * size.height];
      const [sx, sy] = toScreen(view, size, view.x + dx, view.y + dy);
      expect(Math.hypot(px - sx, py - sy)).toBeLessThan(1);
    }
  }
});

describe("cameras that go with somebody", () => {
  const car: Carried = {
    x: 10,
    y: 20,
    z: 3,
    hdg: Math.PI / 2,
    slope: 0,
    length: 4.5,
    width: 1.8,
    category: "car",
  };

  test("a driver sits left of the middle and looks ahead", () => {
    const { eye, target } = seat(car);
    expect(eye[0]).toBeCloseTo(10 - 0.36, 6);
    expect(eye[1]).toBeCloseTo(20 + 0.225, 6);
    expect(eye[2]).toBeCloseTo(4.2, 6);
    expect(target[1] - eye[1]).toBeCloseTo(20, 6);
    expect(target[0]).toBeCloseTo(eye[0], 6);
  });

  test("who follows is behind it and higher", () => {
    const { eye, target } = behind(car);
    expect(eye[1]).toBeLessThan(car.y - car.length);
    expect(eye[2]).toBeGreaterThan(car.z + 2);
    expect(target[1]).toBeGreaterThan(car.y);
  });
});

describe("ground", () => {
  const square = { sizes: [4], steps: [0, 0, 4000, 0, 0, 4000, -4000, 0] };

  test("a surface covers its ring and lies at the height of each corner", () => {
    const made = surface(square, [10, 10], (x) => 0.1 * x, false);
    const at = new BufferAttribute(new Float32Array(made), 3);
    let area = 0;
    for (let i = 0; i < at.count; i += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => new Vector3().fromBufferAttribute(at, i + k)) as [
        Vector3,
        Vector3,
        Vector3,
      ];
      area += ((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)) / 2;
      for (const one of [a, b, c]) expect(one.z).toBeCloseTo(0.1 * one.x, 4);
    }
    expect(area).toBeCloseTo(1600, 3);
  });

  const AREA = 875;
  const LONG = [new Vector2(0, 0), new Vector2(500, 0), new Vector2(500, 3.5)];

  function edgesOf(parts: readonly Vector2[]): { area: number; edges: [Vector2, Vector2][] } {
    let area = 0;
    const edges: [Vector2, Vector2][] = [];
    for (let i = 0; i < parts.length; i += 3) {
      const [a, b, c] = parts.slice(i, i + 3) as [Vector2, Vector2, Vector2];
      area += Math.abs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)) / 2;
      edges.push([a, b], [b, c], [c, a]);
    }
    return { area, edges };
  }

  test("triangles are divided where the ground is bent, keep their area and follow it within 2 cm", () => {
    const hill = (x: number): number =>
      x > 200 && x < 300 ? (x - 200) ** 2 / 2000 : x >= 300 ? x / 10 - 25 : 0;
    const { area, edges } = edgesOf(divided(LONG, hill));
    expect(area).toBeCloseTo(AREA, 6);
    for (const [from, to] of edges)
      for (const share of [0.25, 0.5, 0.75]) {
        const straight = hill(from.x) + share * (hill(to.x) - hill(from.x));
        expect(Math.abs(hill(from.x + share * (to.x - from.x)) - straight)).toBeLessThan(0.02);
      }
    const bent = edges.filter(([{ x }]) => x > 200 && x < 300).length;
    expect(bent).toBeGreaterThan(edges.length / 2);
  });

  test("on even ground, level or not, triangles are cut into few, and a ground that jumps ends too", () => {
    const { area, edges } = edgesOf(divided(LONG, (x, y) => 0.1 * x + 0.02 * y));
    expect(area).toBeCloseTo(AREA, 6);
    expect(edges.length / 3).toBeLessThan(100);
    expect(edgesOf(divided(LONG, (x) => Math.floor(x / 8) % 2)).area).toBeCloseTo(AREA, 6);
  });

  test("triangles are drawn by squares of the ground, each in one of them", () => {
    const all = surface(square, [10, 10], () => 0, true);
    const far = all.map((value, k) => (k % 3 === 0 ? value + 1000 : value));
    const made = tiles([...all, ...far]);
    expect(made.length).toBeGreaterThanOrEqual(2);
    const corners = made.reduce((sum, one) => sum + one.getAttribute("position").count, 0);
    expect(corners * 3).toBe(2 * all.length);
    for (const one of made) {
      one.computeBoundingSphere();
      expect(one.boundingSphere?.radius).toBeLessThan(400);
    }
  });

  test("a broken line is painted and left out in turn, over its corners too", () => {
    const line = [new Vector2(0, 0), new Vector2(10, 0), new Vector2(10, 11)];
    const pieces = strokes(line, [3, 6], Infinity);
    expect(
      pieces.map(([a, b]) => [a.x, a.y, b.x, b.y].map((value) => Math.round(value * 100) / 100)),
    ).toEqual([
      [0, 0, 3, 0],
      [9, 0, 10, 0],
      [10, 0, 10, 2],
      [10, 8, 10, 11],
    ]);
  });
});

test("noon is bright and dry, night has lamps on, rain hides the sun and wets the road", () => {
  const noon = skyOf({ sun_altitude_angle: 75, cloudiness: 5 });
  const night = skyOf({ sun_altitude_angle: -90, fog_density: 60 });
  const rain = skyOf({ sun_altitude_angle: 45, cloudiness: 100, precipitation: 80, wetness: 90 });
  expect([noon.dark, night.dark, rain.dark]).toEqual([false, true, false]);
  expect(night.sun).toBe(0);
  expect(rain.sun).toBeLessThan(noon.sun / 3);
  expect([noon.rain, noon.wet]).toEqual([0, 0]);
  expect([rain.rain, rain.wet]).toEqual([0.8, 0.9]);
  expect(skyOf({ fog_density: 90 }).fog).toBeGreaterThan(10 * noon.fog);
});

test("a picture that takes too long is drawn coarser, one that takes little as sharp as the screen again", () => {
  const sharpness = new Sharpness(2);
  for (let k = 0; k < 30; k++) if (sharpness.isDue()) sharpness.adapt(80);
  expect(sharpness.ratio).toBeLessThan(1.4);
  for (let k = 0; k < 100; k++) if (sharpness.isDue()) sharpness.adapt(80);
  expect(sharpness.ratio).toBeCloseTo(1, 6);
  for (let k = 0; k < 12; k++) if (sharpness.isDue()) sharpness.adapt(20);
  expect(sharpness.ratio).toBeCloseTo(1, 6);
  for (let k = 0; k < 60; k++) if (sharpness.isDue()) sharpness.adapt(5);
  expect(sharpness.ratio).toBe(2);
});
