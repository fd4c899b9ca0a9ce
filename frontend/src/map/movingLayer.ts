import { CATEGORIES } from "../api/types";
import { nth } from "../lists";
import type { Head } from "../signals/heads";
import { BRAKES, CATEGORY_COLOR, EGO, INDICATOR, MARK_COLOR, type Palette, SIGNAL_COLOR } from "./colors";
import { drawMeasured, type MeasureMarks } from "./measureMarks";
import type { Mark, MarkKind, Moving } from "./scene";
import { type Size, type View, visible } from "./view";

/** As the server numbers them. */
export const FLAG_LEFT = 1;
export const FLAG_RIGHT = 2;
export const FLAG_BRAKE = 4;

/** No road user is drawn shorter than this many pixels, so that a whole town can be watched. */
const LEAST = 5;
const OUTLINE_FROM = 4;
const DETAIL_FROM = 6;

const KIND_COLORS = CATEGORIES.map((category) => CATEGORY_COLOR[category]);
const ON_FOOT = CATEGORIES.indexOf("pedestrian");

/** Road users of a run, drawn many at once: one path per colour. */
export class MovingLayer {
  heads: readonly Head[] = [];
  marks: readonly Mark[] = [];
  measured: MeasureMarks | null = null;

  draw(
    context: CanvasRenderingContext2D,
    view: View,
    size: Size,
    ratio: number,
    palette: Palette,
    moving: Moving | null,
  ): void {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const head of this.heads) drawHead(context, head, view, size);
    if (moving) this.drawMoving(context, view, size, palette, moving);
    for (const mark of this.marks) drawMark(context, mark, view, size);
    if (this.measured) drawMeasured(context, view, size, palette, this.measured);
  }

  private drawMoving(
    context: CanvasRenderingContext2D,
    view: View,
    size: Size,
    palette: Palette,
    moving: Moving,
  ): void {
    const { group, colors } = moving.tint ?? { group: moving.category, colors: KIND_COLORS };
    const rows = byGroup(moving, group, colors.length, view, size);
    for (const [n, color] of colors.entries()) {
      const of = nth(rows, n);
      if (of.length === 0) continue;
      context.fillStyle = color;
      context.beginPath();
      for (const row of of) outline(context, moving, row, view, size);
      context.fill();
      if (view.scale >= OUTLINE_FROM) {
        context.strokeStyle = palette.paper;
        context.lineWidth = 1;
        context.stroke();
      }
      if (view.scale >= DETAIL_FROM) {
        for (const row of of) if (moving.category[row] !== ON_FOOT) details(context, moving, row, view, size);
      }
    }
    if (moving.ego >= 0) mark(context, moving, moving.ego, view, size, EGO);
    if (moving.followed >= 0) mark(context, moving, moving.followed, view, size, palette.ink);
  }
}

function byGroup(moving: Moving, group: Uint8Array, groups: number, view: View, size: Size): number[][] {
  const [x0, y0, x1, y1] = visible(view, size);
  const slack = 12;
  const rows: number[][] = Array.from({ length: groups }, () => []);
  for (let i = 0; i < moving.count; i++) {
    const x = nth(moving.pose, 5 * i);
    const y = nth(moving.pose, 5 * i + 1);
    if (x > x0 - slack && x < x1 + slack && y > y0 - slack && y < y1 + slack) {
      nth(rows, nth(group, i)).push(i);
    }
  }
  return rows;
}

/** A body seen from above, its front cut to a blunt wedge so that the heading shows. */
function outline(
  context: CanvasRenderingContext2D,
  moving: Moving,
  row: number,
  view: View,
  size: Size,
): void {
  const { pose } = moving;
  const p = 5 * row;
  const hdg = nth(pose, p + 2);
  const k = Math.max(view.scale, LEAST / Math.max(nth(pose, p + 3), 0.9));
  const half = (nth(pose, p + 3) / 2) * k;
  const side = (nth(pose, p + 4) / 2) * k;
  const x = (nth(pose, p) - view.x) * view.scale + size.width / 2;
  const y = (view.y - nth(pose, p + 1)) * view.scale + size.height / 2;
  const cos = Math.cos(hdg);
  const sin = Math.sin(hdg);
  const nose = half - Math.min(side * 0.7, half);
  context.moveTo(x - half * cos - side * sin, y + half * sin - side * cos);
  context.lineTo(x + nose * cos - side * sin, y - nose * sin - side * cos);
  context.lineTo(x + half * cos - side * 0.45 * sin, y - half * sin - side * 0.45 * cos);
  context.lineTo(x + half * cos + side * 0.45 * sin, y - half * sin + side * 0.45 * cos);
  context.lineTo(x + nose * cos + side * sin, y - nose * sin + side * cos);
  context.lineTo(x - half * cos + side * sin, y + half * sin + side * cos);
  context.closePath();
}

/** Windscreen, brake lights and indicators. */
function details(
  context: CanvasRenderingContext2D,
  moving: Moving,
  row: number,
  view: View,
  size: Size,
): void {
  const { pose } = moving;
  const p = 5 * row;
  const half = nth(pose, p + 3) / 2;
  const side = nth(pose, p + 4) / 2;
  const flags = nth(moving.flags, row);
  context.save();
  context.translate(
    (nth(pose, p) - view.x) * view.scale + size.width / 2,
    (view.y - nth(pose, p + 1)) * view.scale + size.height / 2,
  );
  context.rotate(-nth(pose, p + 2));
  context.scale(view.scale, view.scale);
  if (side > 0.6) {
    context.fillStyle = "#10202caa";
    context.fillRect(half * 0.35, -side * 0.8, Math.min(0.9, half * 0.3), side * 1.6);
  }
  const lamp = Math.min(0.45, side * 0.6);
  if (flags & FLAG_BRAKE) {
    context.fillStyle = BRAKES;
    context.fillRect(-half, -side, lamp * 0.7, lamp);
    context.fillRect(-half, side - lamp, lamp * 0.7, lamp);
  }
  context.fillStyle = INDICATOR;
  if (flags & FLAG_LEFT) corners(context, half, -side, lamp);
  if (flags & FLAG_RIGHT) corners(context, half, side - lamp, lamp);
  context.restore();
}

function corners(context: CanvasRenderingContext2D, half: number, y: number, lamp: number): void {
  context.fillRect(half - lamp, y, lamp, lamp);
  context.fillRect(-half, y, lamp, lamp);
}

function mark(
  context: CanvasRenderingContext2D,
  moving: Moving,
  row: number,
  view: View,
  size: Size,
  color: string,
): void {
  const p = 5 * row;
  const x = (nth(moving.pose, p) - view.x) * view.scale + size.width / 2;
  const y = (view.y - nth(moving.pose, p + 1)) * view.scale + size.height / 2;
  context.strokeStyle = color;
  context.lineWidth = 2.5;
  context.beginPath();
  context.arc(x, y, Math.max(11, nth(moving.pose, p + 3) * 0.75 * view.scale), 0, 2 * Math.PI);
  context.stroke();
}

const SIGN: Record<MarkKind, (context: CanvasRenderingContext2D) => void> = {
  collision: (context) => {
    line(context, -4, -4, 4, 4);
    line(context, -4, 4, 4, -4);
  },
  braking: (context) => {
    line(context, 0, -5, 0, 1);
    line(context, 0, 4, 0, 4.5);
  },
  teleported: (context) => {
    line(context, 0, 5, 0, -4);
    line(context, -3.5, -1, 0, -5);
    line(context, 3.5, -1, 0, -5);
  },
  jam: (context) => {
    line(context, -4, -4, 4, -4);
    line(context, -4, 0, 4, 0);
    line(context, -4, 4, 4, 4);
  },
  measure: (context) => {
    line(context, -4.5, 0, 4.5, 0);
  },
  rule: (context) => {
    line(context, -3, -4, 4, 0);
    line(context, 4, 0, -3, 4);
    line(context, -3, 4, -3, -4);
  },
  met: (context) => {
    line(context, -4, 0.5, -1, 3.5);
    line(context, -1, 3.5, 4, -3.5);
  },
  unmet: (context) => {
    line(context, -4, -2, 4, -2);
    line(context, -4, 2, 4, 2);
    line(context, 2.5, -5, -2.5, 5);
  },
};

function line(context: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
}

/** A sign of constant size; what is past is paler, what is new has a ring around it. */
function drawMark(context: CanvasRenderingContext2D, mark: Mark, view: View, size: Size): void {
  context.save();
  context.translate(
    (mark.x - view.x) * view.scale + size.width / 2,
    (view.y - mark.y) * view.scale + size.height / 2,
  );
  context.globalAlpha = mark.fresh ? 1 : 0.6;
  context.beginPath();
  context.arc(0, 0, mark.fresh ? 11 : 8.5, 0, 2 * Math.PI);
  context.fillStyle = MARK_COLOR[mark.kind];
  context.fill();
  context.strokeStyle = "#ffffff";
  context.lineWidth = 2;
  context.stroke();
  context.beginPath();
  context.lineCap = "round";
  SIGN[mark.kind](context);
  context.stroke();
  if (mark.fresh) {
    context.beginPath();
    context.arc(0, 0, 17, 0, 2 * Math.PI);
    context.strokeStyle = MARK_COLOR[mark.kind];
    context.lineWidth = 3;
    context.stroke();
  }
  context.restore();
}

/** Metres of a signal across its lane, and of one for pedestrians. */
const HEAD = 2.6;
const WALK_HEAD = 1.4;
/** Below this many pixels per metre shapes cannot be distinguished: only dots are drawn. */
const SHAPES_FROM = 1.6;

/**
 * A signal at its stop line: a bar across for red, two short ones for yellow, an arrowhead for green,
 * hollow where one gives way, so that colour alone says nothing.
 */
function drawHead(context: CanvasRenderingContext2D, head: Head, view: View, size: Size): void {
  const x = (head.x - view.x) * view.scale + size.width / 2;
  const y = (view.y - head.y) * view.scale + size.height / 2;
  if (x < -20 || y < -20 || x > size.width + 20 || y > size.height + 20) return;
  context.save();
  context.translate(x, y);
  context.rotate(-head.hdg);
  const color = SIGNAL_COLOR[head.shown];
  const side = Math.min(Math.max(((head.walk ? WALK_HEAD : HEAD) * view.scale) / 2, 3.5), 20);
  context.lineJoin = "round";
  context.strokeStyle = "#1b1f24";
  context.fillStyle = color;
  context.lineWidth = 1.5;
  context.beginPath();
  if (view.scale < SHAPES_FROM) context.arc(0, 0, 3, 0, 2 * Math.PI);
  else shape(context, head.shown, side);
  context.stroke();
  if (head.shown === "permissive" && view.scale >= SHAPES_FROM) {
    context.lineWidth = Math.max(2, side * 0.3);
    context.strokeStyle = color;
    context.stroke();
  } else context.fill();
  context.restore();
}

function shape(context: CanvasRenderingContext2D, shown: Head["shown"], side: number): void {
  const thick = Math.max(3, side * 0.4);
  if (shown === "green" || shown === "permissive") {
    context.moveTo(-side * 0.5, -side);
    context.lineTo(side * 0.9, 0);
    context.lineTo(-side * 0.5, side);
    context.closePath();
  } else if (shown === "yellow") {
    context.rect(-thick / 2, -side, thick, side * 0.75);
    context.rect(-thick / 2, side * 0.25, thick, side * 0.75);
  } else context.rect(-thick / 2, -side, thick, 2 * side);
}
