import { short } from "../language/numbers";
import { gridStep } from "../language/units";
import type { Palette } from "./colors";
import { type Size, toScreen, type View, visible } from "./view";

/** Pixels between two lines of the grid, at least. */
const APART = 70;
/** Pixels that a label keeps from the corners. */
const CORNER = 34;

/** Digits after the point of a coordinate, at most: the map is never as near as a millimetre. */
const DIGITS = 3;

/** A line of the grid: its place, pixels from the left or the top, and its coordinate as written. */
export interface GridLine {
  at: number;
  text: string;
}

/** Lines of constant x and of constant y in sight, at round coordinates of the reader's unit. */
export function gridLines(view: View, size: Size): { x: GridLine[]; y: GridLine[]; unit: string } {
  const { metres, unit, shown } = gridStep(APART / view.scale);
  const [x0, y0, x1, y1] = visible(view, size);
  const lines = (from: number, to: number, place: (metres: number) => number): GridLine[] => {
    const found: GridLine[] = [];
    for (let n = Math.ceil(from / metres); n * metres <= to; n++) {
      found.push({ at: place(n * metres), text: short(n * shown || 0, DIGITS) });
    }
    return found;
  };
  return {
    x: lines(x0, x1, (x) => toScreen(view, size, x, 0)[0]),
    y: lines(y0, y1, (y) => toScreen(view, size, 0, y)[1]),
    unit,
  };
}

/** Draws the grid, with coordinates of the map at the upper and the left edge. */
export function drawGrid(
  context: CanvasRenderingContext2D,
  view: View,
  size: Size,
  palette: Palette,
  path: Path2D,
): void {
  const { x, y, unit } = gridLines(view, size);
  for (const { at } of x) {
    path.moveTo(at, 0);
    path.lineTo(at, size.height);
  }
  for (const { at } of y) {
    path.moveTo(0, at);
    path.lineTo(size.width, at);
  }
  context.strokeStyle = palette.ink;
  context.lineWidth = 1;
  context.globalAlpha = 0.22;
  context.stroke(path);
  context.globalAlpha = 1;
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  const label = (text: string, at: readonly [number, number], align: CanvasTextAlign): void => {
    context.textAlign = align;
    context.strokeStyle = palette.paper;
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeText(text, ...at);
    context.fillStyle = palette.ink;
    context.fillText(text, ...at);
  };
  for (const { at, text } of x) {
    if (at > CORNER && at < size.width - CORNER) label(text, [at, 9], "center");
  }
  for (const { at, text } of y) {
    if (at > CORNER && at < size.height - CORNER) label(text, [4, at], "left");
  }
  label(unit, [4, 9], "left");
}
