import { nth } from "../lists";
import { type Graph, ringOf } from "./graph";
import type { LaneColors } from "./scene";
import type { PathMaker } from "./svg";
import type { View } from "./view";

/** Kind of the edges from a node to the next along a lane. */
const SUCCESSOR = 0;

/** The lane of a node, as the map names it: road, section, lane. */
export const laneKey = ({ columns }: Graph, index: number): string =>
  nth(columns.lane_keys, nth(columns.lane, index));

/** The ring around a lane, x and y in turn; null if the map has no such lane. */
export function laneShape({ columns }: Graph, key: string): Float64Array | null {
  const lane = columns.lane_keys.indexOf(key);
  if (lane < 0) return null;
  const [first, end] = [nth(columns.first_node, lane), columns.first_node[lane + 1] ?? columns.lane.length];
  return end > first ? ringOf(columns, first, end) : null;
}

/** Rings around the lanes inside a junction that lead from the first road of a turn to its last. */
export function turnShapes(graph: Graph, name: string): Float64Array[] {
  const parts = name.split(">");
  const [from, to] = [graph.segmentRow.get(parts[0] ?? ""), graph.segmentRow.get(parts.at(-1) ?? "")];
  if (from === undefined || to === undefined) return [];
  const { columns } = graph;
  const inside = (i: number): boolean => nth(columns.lane_junctions, nth(columns.lane, i)) !== null;
  const ahead = spread(graph, from, inside, "source", "target");
  const behind = spread(graph, to, inside, "target", "source");
  const lanes = new Set([...ahead].filter((i) => behind.has(i)).map((i) => nth(columns.lane, i)));
  return [...lanes].flatMap((lane) => laneShape(graph, nth(columns.lane_keys, lane)) ?? []);
}

/** Nodes inside junctions that are reached from a segment, along or against the direction of travel. */
function spread(
  { columns }: Graph,
  segment: number,
  inside: (i: number) => boolean,
  near: "source" | "target",
  far: "source" | "target",
): Set<number> {
  const { edges } = columns;
  const next = new Map<number, number[]>();
  const found = new Set<number>();
  for (let e = 0; e < edges.source.length; e++) {
    if (nth(edges.relation, e) !== SUCCESSOR) continue;
    const [a, b] = [nth(edges[near], e), nth(edges[far], e)];
    if (!inside(b)) continue;
    if (inside(a)) next.set(a, [...(next.get(a) ?? []), b]);
    else if (nth(columns.segment, a) === segment) found.add(b);
  }
  // A set that grows while it is gone through is gone through to its end.
  for (const i of found) for (const b of next.get(i) ?? []) found.add(b);
  return found;
}

export function addRing(path: Path2D, ring: Float64Array): void {
  path.moveTo(nth(ring, 0), nth(ring, 1));
  for (let i = 2; i < ring.length; i += 2) path.lineTo(nth(ring, i), nth(ring, i + 1));
  path.closePath();
}

/** Of a lane that is thinner on the screen, pixels. */
const THINNEST = 2;
/** Of a lane; the edge of a thinner one is drawn wider. */
const USUAL_WIDTH = 3;

/** Draws lanes in colours; their paths are kept as long as the colours are. */
export class ColoredLanes {
  private of: LaneColors | null = null;
  private paths: readonly Path2D[] = [];

  constructor(private readonly newPath: PathMaker) {}

  draw(context: CanvasRenderingContext2D, { scale }: View, shown: LaneColors | null): void {
    if (!shown) return;
    if (shown !== this.of) {
      this.of = shown;
      this.paths = shown.rings.map((rings) => {
        const path = this.newPath();
        for (const ring of rings) addRing(path, ring);
        return path;
      });
    }
    // A hair of stroke closes the seams between rings that touch.
    context.lineWidth = Math.max(0.5 / scale, THINNEST / scale - USUAL_WIDTH);
    this.paths.forEach((path, n) => {
      context.fillStyle = context.strokeStyle = nth(shown.colors, n);
      context.fill(path);
      context.stroke(path);
    });
  }
}
