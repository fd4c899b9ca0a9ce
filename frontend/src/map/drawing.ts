import type { Bounds, PackedDrawing, PackedLines } from "../api/types";
import { nth } from "../lists";

export type { PackedDrawing, PackedLines };

/** Many polylines or rings: line `k` is `xy[2 * start[k]]` up to `xy[2 * start[k + 1]]`. */
export interface Lines {
  xy: Float64Array;
  start: Uint32Array;
}

export function unpack(packed: PackedLines): Lines {
  const { sizes, steps } = packed;
  const xy = new Float64Array(steps.length);
  let x = 0;
  let y = 0;
  for (let i = 0; i < steps.length; i += 2) {
    x += nth(steps, i);
    y += nth(steps, i + 1);
    xy[i] = x / 100;
    xy[i + 1] = y / 100;
  }
  const start = new Uint32Array(sizes.length + 1);
  for (let k = 0; k < sizes.length; k++) start[k + 1] = nth(start, k) + nth(sizes, k);
  return { xy, start };
}

/** Lines near each other, to be drawn or skipped together. */
export interface Tile {
  bounds: Bounds;
  rows: number[];
}

/** Groups lines by the grid cell of their middle; every line is in exactly one tile. */
export function tiles(lines: Lines, cell: number): Tile[] {
  const found = new Map<string, Tile>();
  for (let k = 0; k + 1 < lines.start.length; k++) {
    const b = boundsOf(lines, k);
    const key = `${Math.floor((b[0] + b[2]) / 2 / cell)},${Math.floor((b[1] + b[3]) / 2 / cell)}`;
    const tile = found.get(key);
    if (!tile) found.set(key, { bounds: b, rows: [k] });
    else {
      tile.rows.push(k);
      tile.bounds = joined(tile.bounds, b);
    }
  }
  return [...found.values()];
}

export function boundsOf(lines: Lines, k: number): Bounds {
  const b: Bounds = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = nth(lines.start, k); i < nth(lines.start, k + 1); i++) {
    const x = nth(lines.xy, 2 * i);
    const y = nth(lines.xy, 2 * i + 1);
    if (x < b[0]) b[0] = x;
    if (y < b[1]) b[1] = y;
    if (x > b[2]) b[2] = x;
    if (y > b[3]) b[3] = y;
  }
  return b;
}

export const joined = (a: Bounds, b: Bounds): Bounds => [
  Math.min(a[0], b[0]),
  Math.min(a[1], b[1]),
  Math.max(a[2], b[2]),
  Math.max(a[3], b[3]),
];
