import { BufferAttribute, BufferGeometry, ShapeUtils, Vector2 } from "three";

import type { PackedLines } from "../api/types";
import { nth } from "../lists";
import { type Lines, unpack } from "../map/drawing";

/** Height of the ground at a place of the scene, m. */
export type HeightAt = (x: number, y: number) => number;

/** Where the middle of the scene is on the map, metres: floats of the graphics are too short for both. */
export type Origin = readonly [x: number, y: number];

/** Longest piece of a line, and edge of a surface, that follows a ground which is not flat, m. */
const [LONGEST, WIDEST] = [6, 60];
/** How far an edge may be from the ground, m: less than the paint is above it. */
const BULGE = 0.015;
/** Cuts of a triangle into halves at most: slivers would never end. */
const MOST_CUTS = 14;
/** Side of a square whose triangles are drawn together, m. */
const SQUARE = 250;
/** Numbers of a triangle. */
const CORNERS = 9;

/** Filled rings that lie on the ground: corners of triangles. */
export function surface(packed: PackedLines, origin: Origin, height: HeightAt, flat: boolean): number[] {
  const places: number[] = [];
  for (const ring of ringsOf(unpack(packed), origin)) {
    for (const corners of ShapeUtils.triangulateShape(ring, [])) {
      const triangle = corners.map((corner) => nth(ring, corner));
      for (const { x, y } of flat ? upwards(triangle) : divided(upwards(triangle), height))
        places.push(x, y, height(x, y));
    }
  }
  return places;
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

/** Lines of a width that lie on the ground, whole or broken (painted, gap; metres): corners of triangles. */
export function ribbons(
  packed: PackedLines,
  width: number,
  dash: readonly [number, number] | null,
  origin: Origin,
  height: HeightAt,
  flat: boolean,
): number[] {
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
  return places;
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

/** Triangles whose edges all lie on the ground; neighbours share their edges still. */
export function divided(triangle: readonly Vector2[], height: HeightAt, cuts = MOST_CUTS): Vector2[] {
  const [a, b, c] = [nth(triangle, 0), nth(triangle, 1), nth(triangle, 2)];
  const edges = [
    [a, b, c],
    [b, c, a],
    [c, a, b],
  ] as const;
  // What is cut depends on an edge alone, so that both its sides cut it in the same place.
  const bent = cuts > 0 ? edges.filter(([from, to]) => leavesGround(from, to, height)) : [];
  if (bent.length === 0) return [a, b, c];
  const [from, to, other] = bent.reduce((longest, edge) =>
    edge[0].distanceTo(edge[1]) > longest[0].distanceTo(longest[1]) ? edge : longest,
  );
  const middle = from.clone().add(to).multiplyScalar(0.5);
  return [
    ...divided([from, middle, other], height, cuts - 1),
    ...divided([middle, to, other], height, cuts - 1),
  ];
}

function leavesGround(from: Vector2, to: Vector2, height: HeightAt): boolean {
  const long = from.distanceTo(to);
  if (long < LONGEST) return false;
  if (long > WIDEST) return true;
  const [low, high] = [height(from.x, from.y), height(to.x, to.y)];
  const pieces = Math.ceil(long / (LONGEST / 2));
  for (let k = 1; k < pieces; k++) {
    const share = k / pieces;
    const ground = height(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y));
    if (Math.abs(ground - low - share * (high - low)) > BULGE) return true;
  }
  return false;
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

/** Triangles by squares of the ground, so that what is out of sight is not drawn. */
export function tiles(triangles: readonly number[]): BufferGeometry[] {
  const squares = new Map<string, number[]>();
  for (let i = 0; i < triangles.length; i += CORNERS) {
    const corners = triangles.slice(i, i + CORNERS);
    const key = [0, 1].map((axis) => Math.floor(nth(corners, axis) / SQUARE)).join();
    const square = squares.get(key);
    if (square) square.push(...corners);
    else squares.set(key, corners);
  }
  return [...squares.values()].map(sharingCorners);
}

/** A surface in which triangles that meet have their corners in common. */
function sharingCorners(places: readonly number[]): BufferGeometry {
  const numbers = new Map<string, number>();
  const corners: number[] = [];
  const index: number[] = [];
  for (let i = 0; i < places.length; i += 3) {
    const corner = places.slice(i, i + 3);
    const key = corner.join();
    const known = numbers.get(key);
    index.push(known ?? numbers.size);
    if (known !== undefined) continue;
    numbers.set(key, numbers.size);
    corners.push(...corner);
  }
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(corners), 3));
  made.setIndex(index);
  made.computeBoundingSphere();
  return made;
}
