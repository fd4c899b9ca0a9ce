import { measuredLength } from "../language/units";
import type { Palette } from "./colors";
import { type Measured, type Point, sides } from "./measure";
import { type Size, toScreen, type View } from "./view";

/** Pixels of a side from which its length has room beside it. */
const ROOM = 56;
const DASH = [6, 5];
const FULL_CIRCLE = 2 * Math.PI;

/** What is measured, and the place of the pointer, to which a line leads that is not measured yet. */
export interface MeasureMarks {
  measured: Measured;
  pointer: Point | null;
}

/** Draws the sides with the length of each, the points and the area that they go around. */
export function drawMeasured(
  context: CanvasRenderingContext2D,
  view: View,
  size: Size,
  palette: Palette,
  { measured, pointer }: MeasureMarks,
): void {
  const { points, closed } = measured;
  const at = (point: Point): Point => toScreen(view, size, ...point);
  const last = points.at(-1);
  const onward = pointer && last && !closed ? sides({ points: [last, pointer], closed: false }) : [];
  context.lineJoin = context.lineCap = "round";
  context.lineWidth = 2.5;
  context.strokeStyle = context.fillStyle = palette.measured;
  context.beginPath();
  points.forEach((point, n) => (n ? context.lineTo(...at(point)) : context.moveTo(...at(point))));
  if (closed) {
    context.closePath();
    context.globalAlpha = 0.18;
    context.fill();
    context.globalAlpha = 1;
  }
  context.stroke();
  context.setLineDash(DASH);
  for (const { from, to } of onward) {
    context.beginPath();
    context.moveTo(...at(from));
    context.lineTo(...at(to));
    context.stroke();
  }
  context.setLineDash([]);
  context.fillStyle = palette.paper;
  points.forEach((point, n) => {
    context.beginPath();
    context.arc(...at(point), n === 0 ? 6 : 4.5, 0, FULL_CIRCLE);
    context.fill();
    context.stroke();
  });
  for (const { from, to, metres } of [...sides(measured), ...onward]) {
    const [[x0, y0], [x1, y1]] = [at(from), at(to)];
    if (Math.hypot(x1 - x0, y1 - y0) < ROOM) continue;
    write(context, measuredLength(metres), (x0 + x1) / 2, (y0 + y1) / 2, palette);
  }
}

function write(
  context: CanvasRenderingContext2D,
  text: string,
  x: number,
  y: number,
  { ink, paper }: Palette,
): void {
  context.font = "600 13px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.strokeStyle = paper;
  context.lineWidth = 4;
  context.strokeText(text, x, y);
  context.fillStyle = ink;
  context.fillText(text, x, y);
}
