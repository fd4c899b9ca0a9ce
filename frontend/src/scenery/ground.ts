import { BufferAttribute, BufferGeometry, ShapeUtils, Vector2 } from "three";

import type { PackedLines } from "../api/types";
import { nth } from "../lists";
import { type Lines, unpack } from "../map/drawing";

/** Height of the ground at a place of the scene, m. */
export type HeightAt = (x: number, y: number) => number;

/** Where the middle of the scene is on the map, metres: floats of the graphics are too short for both. */
export type Origin = readonly [x: number, y: number];

/** Longest edge of a surface that follows a ground which is not flat, m. */
const LONGEST = 6;

/** Filled rings that lie on the ground. */
export function surface(
  packed: PackedLines,
  origin: Origin,
  height: HeightAt,
  flat: boolean,
): BufferGeometry {
  const places: number[] = [];
  for (const ring of ringsOf(unpack(packed), origin)) {
    for (const corners of ShapeUtils.triangulateShape(ring, [])) {
      const triangle = corners.map((corner) => nth(ring, corner));
      for (const { x, y } of flat ? upwards(triangle) : divided(upwards(triangle)))
        places.push(x, y, height(x, y));
    }
  }
  return withUpNormals(places);
}

/** Rings raised to walls with a roof. */
export function blocks(
  packed: PackedLines,
  origin: Origin,
  height: HeightAt,
  tall: (ring: number) => number,
): BufferGeometry {
  const places: number[] = [];
  ringsOf(unpack(packed), origin).forEach((ring, number) => {
    const low = ring.reduce((least, { x, y }) => Math.min(least, height(x, y)), Infinity);
    const top = low + tall(number);
    for (const corners of ShapeUtils.triangulateShape(ring, []))
      for (const { x, y } of upwards(corners.map((corner) => nth(ring, corner)))) places.push(x, y, top);
    const round = ShapeUtils.isClockWise(ring) ? ring.toReversed() : ring;
    round.forEach((a, k) => {
      const b = nth(round, (k + 1) % round.length);
      places.push(a.x, a.y, low, b.x, b.y, low, b.x, b.y, top, a.x, a.y, low, b.x, b.y, top, a.x, a.y, top);
    });
  });
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  made.computeVertexNormals();
  return made;
}

/** Lines of a width that lie on the ground, whole or broken (painted, gap; metres). */
export function ribbons(
  packed: PackedLines,
  width: number,
  dash: readonly [number, number] | null,
  origin: Origin,
  height: HeightAt,
  flat: boolean,
): BufferGeometry {
  const places: number[] = [];
  const lines = unpack(packed);
  for (let k = 0; k + 1 < lines.start.length; k++)
    for (const [a, b] of strokes(pointsOf(lines, k, origin), dash, flat ? Infinity : LONGEST)) {
      const long = a.distanceTo(b);
      if (long < 1e-6) continue;
      const [ox, oy] = [((a.y - b.y) / long) * (width / 2), ((b.x - a.x) / long) * (width / 2)];
      const [p, q, r, s] = [
        [a.x - ox, a.y - oy, height(a.x, a.y)],
        [b.x - ox, b.y - oy, height(b.x, b.y)],
        [b.x + ox, b.y + oy, height(b.x, b.y)],
        [a.x + ox, a.y + oy, height(a.x, a.y)],
      ] as const;
      places.push(...p, ...q, ...r, ...p, ...r, ...s);
    }
  return withUpNormals(places);
}

/** Painted pieces of a line, none longer than `most`. */
export function strokes(
  points: readonly Vector2[],
  dash: readonly [number, number] | null,
  most: number,
): [Vector2, Vector2][] {
  const made: [Vector2, Vector2][] = [];
  const [painted, gap] = dash ?? [Infinity, 0];
  let along = 0;
  for (let k = 0; k + 1 < points.length; k++) {
    const [a, b] = [nth(points, k), nth(points, k + 1)];
    const long = a.distanceTo(b);
    let from = 0;
    while (from < long - 1e-9) {
      const phase = dash ? (along + from) % (painted + gap) : 0;
      const on = phase < painted - 1e-9;
      const left = on ? painted - phase : painted + gap - phase;
      const to = Math.min(from + left, from + most, long);
      if (on) made.push([a.clone().lerp(b, from / long), a.clone().lerp(b, to / long)]);
      from = to;
    }
    along += long;
  }
  return made;
}

/** Triangles of which no edge is longer than {@link LONGEST}; neighbours share their edges still. */
export function divided(triangle: readonly Vector2[]): Vector2[] {
  const [a, b, c] = [nth(triangle, 0), nth(triangle, 1), nth(triangle, 2)];
  const edges = [
    [a, b, c],
    [b, c, a],
    [c, a, b],
  ] as const;
  const [from, to, other] = edges.reduce((longest, edge) =>
    edge[0].distanceTo(edge[1]) > longest[0].distanceTo(longest[1]) ? edge : longest,
  );
  if (from.distanceTo(to) <= LONGEST) return [a, b, c];
  const middle = from.clone().add(to).multiplyScalar(0.5);
  return [...divided([from, middle, other]), ...divided([middle, to, other])];
}

/** Counterclockwise, so that it is seen from above. */
function upwards(triangle: Vector2[]): Vector2[] {
  return ShapeUtils.isClockWise(triangle) ? triangle.toReversed() : triangle;
}

function ringsOf(lines: Lines, origin: Origin): Vector2[][] {
  const rings: Vector2[][] = [];
  for (let k = 0; k + 1 < lines.start.length; k++) {
    const ring = pointsOf(lines, k, origin);
    const [first, last] = [ring[0], ring.at(-1)];
    if (ring.length > 1 && first && last?.equals(first)) ring.pop();
    if (ring.length >= 3) rings.push(ring);
  }
  return rings;
}

function pointsOf(lines: Lines, k: number, [x, y]: Origin): Vector2[] {
  const points: Vector2[] = [];
  for (let i = nth(lines.start, k); i < nth(lines.start, k + 1); i++)
    points.push(new Vector2(nth(lines.xy, 2 * i) - x, nth(lines.xy, 2 * i + 1) - y));
  return points;
}

/** Triangles that are lit as if they were level, so that they show no facets. */
export function withUpNormals(places: readonly number[]): BufferGeometry {
  const made = new BufferGeometry();
  const normals = new Float32Array(places.length);
  for (let i = 2; i < normals.length; i += 3) normals[i] = 1;
  made.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  made.setAttribute("normal", new BufferAttribute(normals, 3));
  return made;
}
