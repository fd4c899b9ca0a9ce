import type { Bounds } from "../api/types";

export type Pixels = readonly [x: number, y: number];

/** A button held down: where it was pressed, where the pointer was last, and what the drag does. */
export interface Drag {
  from: [number, number];
  last: [number, number];
  moved: boolean;
  does: "pan" | "carry" | "frame" | "lasso";
  /** What it has drawn so far, pixels. */
  line: readonly Pixels[];
}

/** Two corners of a rectangle, or all points of a line. */
export const lineOf = ({ does, from, line }: Drag, to: Pixels): Pixels[] =>
  does === "lasso" ? [from, ...line.slice(1), to] : [from, to];

/** The rectangle around some points. */
export const boundsOf = (points: readonly Pixels[]): Bounds => {
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
};

/** Corners of a rectangle, one after the other. */
export const corners = ([x0, y0, x1, y1]: Bounds): [number, number][] => [
  [x0, y0],
  [x1, y0],
  [x1, y1],
  [x0, y1],
];
