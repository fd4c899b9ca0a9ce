import { nth } from "../lists";
import type { Palette } from "./colors";
import type { Graph } from "./graph";
import { type Size, toScreen, type View } from "./view";

/** A name of a segment and the place on it where it is written; metres. */
export interface SegmentName {
  text: string;
  x: number;
  y: number;
  /** Of how many nodes of lanes the segment is: the largest are named first. */
  nodes: number;
}

interface Box {
  x: number;
  y: number;
  width: number;
}

const HEIGHT = 16;
/** Metres of a segment, about, for each pixel that its name needs: shorter ones are named when near. */
const SPACING = 2;

/** Names of all segments that have lanes, the largest first, each on the node nearest to its middle. */
export function segmentNames({ columns }: Graph): SegmentName[] {
  const rows: number[][] = columns.segments.map(() => []);
  columns.segment.forEach((row, node) => nth(rows, row).push(node));
  const found: SegmentName[] = [];
  rows.forEach((nodes, row) => {
    if (nodes.length === 0) return;
    const mean = (of: ArrayLike<number>): number =>
      nodes.reduce((sum, node) => sum + nth(of, node), 0) / nodes.length;
    const [x, y] = [mean(columns.x), mean(columns.y)];
    const away = (node: number): number => Math.hypot(nth(columns.x, node) - x, nth(columns.y, node) - y);
    const middle = nodes.reduce((best, node) => (away(node) < away(best) ? node : best));
    const text = nth(columns.segments, row).id;
    found.push({ text, x: nth(columns.x, middle), y: nth(columns.y, middle), nodes: nodes.length });
  });
  return found.sort((a, b) => b.nodes - a.nodes);
}

/** Those of the names that are in sight and lie on no other; `width` in pixels by text. */
export function roomFor(
  names: readonly SegmentName[],
  view: View,
  size: Size,
  width: (text: string) => number,
): (SegmentName & Box)[] {
  const kept: (SegmentName & Box)[] = [];
  for (const one of names) {
    const [x, y] = toScreen(view, size, one.x, one.y);
    if (x < 0 || y < 0 || x > size.width || y > size.height) continue;
    const box = { x, y, width: width(one.text) };
    // A name that is much longer than its segment says little.
    if (one.nodes * SPACING * view.scale < box.width) continue;
    const free = kept.every(
      (other) => Math.abs(other.x - x) > (other.width + box.width) / 2 || Math.abs(other.y - y) > HEIGHT + 2,
    );
    if (free) kept.push({ ...one, ...box });
  }
  return kept;
}

/** Writes the names of segments. */
export function drawNames(
  context: CanvasRenderingContext2D,
  view: View,
  size: Size,
  palette: Palette,
  names: readonly SegmentName[],
): void {
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.lineWidth = 4;
  const width = (text: string): number => context.measureText(text).width + 8;
  for (const { text, x, y } of roomFor(names, view, size, width)) {
    context.strokeStyle = palette.paper;
    context.strokeText(text, x, y);
    context.fillStyle = palette.ink;
    context.fillText(text, x, y);
  }
}
