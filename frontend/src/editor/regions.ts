import { nth } from "../lists";
import type { Area } from "../map/areas";
import type { Graph } from "../map/graph";

/** Rows of the segments of which at least half lies in an area. */
export function rowsWithin({ columns }: Graph, area: Area): number[] {
  const all = new Uint32Array(columns.segments.length);
  const within = new Uint32Array(columns.segments.length);
  for (let i = 0; i < columns.x.length; i++) {
    const [x, y, row] = [nth(columns.x, i), nth(columns.y, i), nth(columns.segment, i)];
    all[row] = (all[row] ?? 0) + 1;
    if (area(x, y)) within[row] = (within[row] ?? 0) + 1;
  }
  return columns.segments.flatMap((_, row) => {
    const inside = within[row] ?? 0;
    return inside > 0 && 2 * inside >= (all[row] ?? 0) ? [row] : [];
  });
}

/** What a region can be extended by: what hangs together with it, and how many segments do not. */
export interface Extension {
  segments: string[];
  left: number;
}

/**
 * The part of some segments that hangs together with a region through each other, nearest first; with
 * no region yet the largest part of them that hangs together.
 */
export function extension(graph: Graph, roi: readonly string[], rows: readonly number[]): Extension {
  const wanted = new Set(rows);
  for (const id of roi) wanted.delete(graph.segmentRow.get(id) ?? -1);
  const name = (found: readonly number[]): Extension => ({
    segments: found.map((row) => graph.segmentId(row)),
    left: wanted.size - found.length,
  });
  if (roi.length > 0) {
    const inside = roi.flatMap((id) => graph.segmentRow.get(id) ?? []);
    return name(reached(graph, inside, wanted).slice(inside.length));
  }
  let largest: number[] = [];
  const rest = new Set(wanted);
  for (const row of wanted) {
    if (!rest.has(row)) continue;
    const part = reached(graph, [row], rest);
    for (const one of part) rest.delete(one);
    if (part.length > largest.length) largest = part;
  }
  return name(largest);
}

/** The rows that are begun with, and those of `among` that are reached from them through each other. */
function reached({ columns }: Graph, begin: readonly number[], among: ReadonlySet<number>): number[] {
  const found = [...begin];
  const known = new Set(begin);
  for (const row of found)
    for (const next of nth(columns.segments, row).neighbours) {
      if (known.has(next) || !among.has(next)) continue;
      known.add(next);
      found.push(next);
    }
  return found;
}
