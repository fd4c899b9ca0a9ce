import { t } from "@lingui/core/macro";

import { nth } from "../lists";
import {
  FLOW,
  GOAL,
  MARK_COLOR,
  MEASURE,
  type Palette,
  PEDESTRIAN_NODE,
  PROBLEM,
  ROI_BASE,
  TRANSIT,
  VEHICLE_NODE,
} from "./colors";
import type { Graph, Place } from "./graph";
import type { Scene, SceneActor, SceneFlow, SceneGhost, ScenePin } from "./scene";
import type { View } from "./view";
import type { Category } from "../api/types";

export function dots(
  context: CanvasRenderingContext2D,
  view: View,
  at: { x: number[]; y: number[] },
  rows: number[],
  color: string,
): void {
  const r = Math.min(Math.max(1.5, view.scale * 0.3), 6) / view.scale;
  context.fillStyle = color;
  context.beginPath();
  for (const i of rows) {
    if (view.scale < 5) context.rect(nth(at.x, i) - r, nth(at.y, i) - r, 2 * r, 2 * r);
    else {
      context.moveTo(nth(at.x, i) + r, nth(at.y, i));
      context.arc(nth(at.x, i), nth(at.y, i), r, 0, 2 * Math.PI);
    }
  }
  context.fill();
}

export function drawWalkEdges(
  context: CanvasRenderingContext2D,
  view: View,
  graph: Graph,
  rows: Set<number>,
): void {
  const { walks } = graph.columns;
  context.beginPath();
  for (let e = 0; e < walks.source.length; e++) {
    if (!rows.has(nth(walks.source, e))) continue;
    context.moveTo(nth(walks.x, nth(walks.source, e)), nth(walks.y, nth(walks.source, e)));
    context.lineTo(nth(walks.x, nth(walks.target, e)), nth(walks.y, nth(walks.target, e)));
  }
  context.strokeStyle = "#a58a00";
  context.lineWidth = 1.1 / view.scale;
  context.stroke();
}

export function drawRoute(context: CanvasRenderingContext2D, view: View, scene: Scene): void {
  if (scene.route.length < 2) return;
  context.beginPath();
  scene.route.forEach(([x, y], n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.lineCap = "round";
  context.lineJoin = "round";
  context.strokeStyle = "#ffffff";
  context.lineWidth = Math.max(1.3, 7 / view.scale);
  context.stroke();
  context.strokeStyle = "#1f9bf0";
  context.lineWidth = Math.max(0.8, 4 / view.scale);
  context.stroke();
}

/** Lines of rules: with a dot at each point and an arrow head where they end. */
/** Recorded tracks as thin dotted lines, and bodies as dashed outlines. */
export function drawGhosts(
  context: CanvasRenderingContext2D,
  view: View,
  ghosts: readonly SceneGhost[],
  palette: Palette,
): void {
  const px = 1 / view.scale;
  context.strokeStyle = palette.ink;
  context.lineWidth = 1.2 * px;
  context.globalAlpha = 0.5;
  context.setLineDash([2 * px, 3 * px]);
  context.beginPath();
  for (const { points } of ghosts)
    points.forEach(([x, y], n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
  context.globalAlpha = 0.85;
  context.setLineDash([3 * px, 2 * px]);
  context.beginPath();
  for (const { body } of ghosts) {
    if (!body) continue;
    const [c, s] = [Math.cos(body.hdg), Math.sin(body.hdg)];
    const [a, b] = [body.length / 2, body.width / 2];
    [
      [a, b],
      [-a, b],
      [-a, -b],
      [a, -b],
      [a, b],
    ].forEach(([u = 0, v = 0], n) => {
      const [x, y] = [body.x + u * c - v * s, body.y + u * s + v * c];
      if (n) context.lineTo(x, y);
      else context.moveTo(x, y);
    });
  }
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

export function drawLines(context: CanvasRenderingContext2D, view: View, { lines }: Scene): void {
  context.lineCap = context.lineJoin = "round";
  for (const { points, strong, arrow } of lines) {
    if (points.length < 2) continue;
    context.globalAlpha = strong ? 1 : 0.55;
    context.beginPath();
    points.forEach(([x, y], n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (arrow) addHead(context, points, 11 / view.scale);
    context.setLineDash(arrow ? [] : [6 / view.scale, 5 / view.scale]);
    for (const [color, width] of [
      ["#ffffff", strong ? 6 : 4],
      [MARK_COLOR.rule, strong ? 3.5 : 2],
    ] as const) {
      context.strokeStyle = color;
      context.lineWidth = width / view.scale;
      context.stroke();
    }
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
}

function addHead(path: CanvasPath, points: readonly (readonly [number, number])[], size: number): void {
  const [x, y] = nth(points, points.length - 1);
  const [x0, y0] = nth(points, points.length - 2);
  const hdg = Math.atan2(y - y0, x - x0);
  for (const side of [2.6, -2.6]) {
    path.moveTo(x, y);
    path.lineTo(x + size * Math.cos(hdg + side), y + size * Math.sin(hdg + side));
  }
}

/** The lane under the pointer, through its places. */
export function drawLane(context: CanvasRenderingContext2D, graph: Graph, place: Place): void {
  const at = place.walk ? graph.columns.walks : graph.columns;
  const [first, end] = graph.lanePlaces(place);
  context.beginPath();
  for (let i = first; i < end; i++) context.lineTo(nth(at.x, i), nth(at.y, i));
  context.lineCap = "butt";
  context.lineWidth = nth(at.width, place.index);
  context.strokeStyle = place.walk ? `${PEDESTRIAN_NODE}55` : `${VEHICLE_NODE}44`;
  context.stroke();
}

/** How far beside the middle of its lane a road user starts. */
export function drawOffset(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  view: View,
  actor: SceneActor,
  palette: Palette,
): void {
  const cx = x + actor.offset * Math.sin(actor.hdg) * view.scale;
  const cy = y + actor.offset * Math.cos(actor.hdg) * view.scale;
  const along = actor.length * 0.75 * view.scale;
  const [dx, dy] = [along * Math.cos(actor.hdg), -along * Math.sin(actor.hdg)];
  context.strokeStyle = palette.ink;
  context.lineWidth = 1.5;
  context.setLineDash([5, 4]);
  context.beginPath();
  context.moveTo(cx - dx, cy - dy);
  context.lineTo(cx + dx, cy + dy);
  context.stroke();
  context.setLineDash([]);
}

export function spot(context: CanvasRenderingContext2D, [x, y]: [number, number], color: string): void {
  context.beginPath();
  context.arc(x, y, 4, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
}

/** Chevrons in the direction of travel, and the volume per hour. */
export function drawFlow(
  context: CanvasRenderingContext2D,
  [x, y]: [number, number],
  flow: SceneFlow,
  palette: Palette,
): void {
  context.save();
  context.translate(x, y);
  context.rotate(-flow.hdg);
  context.lineCap = context.lineJoin = "round";
  const rim = flow.problem ? PROBLEM : flow.selected ? palette.ink : "#ffffff";
  for (const [color, width] of [
    [rim, flow.selected || flow.problem ? 9 : 7],
    [flow.walk ? PEDESTRIAN_NODE : FLOW, 4],
  ] as const) {
    context.strokeStyle = color;
    context.lineWidth = width;
    context.beginPath();
    for (const k of [-12, -1, 10]) {
      context.moveTo(k - 4, -8);
      context.lineTo(k + 4, 0);
      context.lineTo(k - 4, 8);
    }
    context.stroke();
  }
  context.restore();
  if (flow.selected) brackets(context, [x, y], 20, palette.ink);
  tag(context, t`${Math.round(flow.perHour)} per hour`, x, y - 22);
}

/** Corners around what is selected, so that not only its colour says so. */
export function brackets(
  context: CanvasRenderingContext2D,
  [x, y]: [number, number],
  half: number,
  color: string,
): void {
  const arm = half * 0.55;
  for (const [width, stroke] of [
    [5, "#ffffff"],
    [2.5, color],
  ] as const) {
    context.beginPath();
    for (const [sx, sy] of [
      [-1, -1],
      [1, -1],
      [1, 1],
      [-1, 1],
    ] as const) {
      context.moveTo(x + sx * half, y + sy * (half - arm));
      context.lineTo(x + sx * half, y + sy * half);
      context.lineTo(x + sx * (half - arm), y + sy * half);
    }
    context.lineWidth = width;
    context.strokeStyle = stroke;
    context.stroke();
  }
}

/** Goals that can be had are diamonds, for starts are round; the one that is chosen has a flag. */
export function drawGoal(context: CanvasRenderingContext2D, [x, y]: [number, number], chosen: boolean): void {
  context.beginPath();
  if (chosen) context.arc(x, y, 13, 0, 2 * Math.PI);
  else {
    context.moveTo(x, y - 9);
    context.lineTo(x + 9, y);
    context.lineTo(x, y + 9);
    context.lineTo(x - 9, y);
    context.closePath();
  }
  context.fillStyle = chosen ? ROI_BASE : GOAL;
  context.fill();
  context.lineWidth = 2.5;
  context.strokeStyle = chosen ? GOAL : "#ffffff";
  context.stroke();
  if (!chosen) return;
  context.beginPath();
  context.moveTo(x - 2.5, y + 5);
  context.lineTo(x - 2.5, y - 6);
  context.lineTo(x + 5, y - 3);
  context.lineTo(x - 2.5, y);
  context.fillStyle = context.strokeStyle = "#ffffff";
  context.fill();
  context.lineWidth = 1.5;
  context.stroke();
}

/** Several signs that would hide each other: their number, twice ringed. */
export function drawCluster(
  context: CanvasRenderingContext2D,
  [x, y]: [number, number],
  number: number,
  palette: Palette,
): void {
  for (const [radius, color] of [
    [15, palette.paper],
    [13, palette.ink],
    [11, palette.paper],
  ] as const) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = color;
    context.fill();
  }
  context.font = "700 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = palette.ink;
  context.fillText(String(number), x, y + 0.5);
}

/** Waypoints are squares with their numbers. */
export function drawWaypoint(
  context: CanvasRenderingContext2D,
  [x, y]: [number, number],
  number: number,
): void {
  context.beginPath();
  context.roundRect(x - 9, y - 9, 18, 18, 3);
  context.fillStyle = ROI_BASE;
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = "#ffffff";
  context.stroke();
  context.font = "700 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = "#ffffff";
  context.fillText(String(number), x, y + 0.5);
}

/** Pixels; a motorcycle is seen, too. */
const LEAST_WIDTH = 5;
/** Pixels of a body's width from which its kind is drawn in it. */
const GLYPH_FROM = 11;

export function body(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  view: View,
  actor: SceneActor,
  color: string,
  ring: string | null,
): void {
  context.save();
  context.translate(x, y);
  context.rotate(-actor.hdg);
  const l = actor.length * view.scale;
  const w = Math.max(LEAST_WIDTH, actor.width * view.scale);
  context.fillStyle = color;
  context.beginPath();
  context.moveTo(-l / 2, -w / 2);
  context.lineTo(l / 2 - w * 0.35, -w / 2);
  context.lineTo(l / 2, -w * 0.22);
  context.lineTo(l / 2, w * 0.22);
  context.lineTo(l / 2 - w * 0.35, w / 2);
  context.lineTo(-l / 2, w / 2);
  context.closePath();
  for (const [stroke, width] of [[ring, 6] as const, ["#ffffff", 1.5] as const]) {
    if (stroke === null) continue;
    context.strokeStyle = stroke;
    context.lineWidth = width;
    context.stroke();
  }
  context.fill();
  context.restore();
}

/** The kind of a road user in its body, which is so many pixels wide; nothing where it would not be seen. */
export function inBody(
  context: CanvasRenderingContext2D,
  glyph: Path2D,
  x: number,
  y: number,
  width: number,
  category: Category,
): void {
  if (width < GLYPH_FROM) return;
  drawGlyph(context, glyph, x, y, Math.min(width * 0.85, 26), category);
}

function drawGlyph(
  context: CanvasRenderingContext2D,
  glyph: Path2D,
  x: number,
  y: number,
  size: number,
  category: Category,
): void {
  context.save();
  context.translate(x, y);
  context.scale(size / 24, size / 24);
  context.translate(-12, -12);
  context.fillStyle = category === "pedestrian" ? "#22282e" : "#ffffff";
  context.fill(glyph, "evenodd");
  context.restore();
}

export function badge(
  context: CanvasRenderingContext2D,
  glyph: Path2D,
  x: number,
  y: number,
  radius: number,
  color: string,
  category: Category,
): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
  context.lineWidth = 1.5;
  context.strokeStyle = "#ffffff";
  context.stroke();
  drawGlyph(context, glyph, x, y, radius * 1.45, category);
}

/** A round sign with a name below it: orange for measures, dark blue for public transport, blue for rules. */
export function drawPin(
  context: CanvasRenderingContext2D,
  [x, y]: [number, number],
  pin: ScenePin,
  named: boolean,
): void {
  const measure = pin.sign === "!" || pin.sign === "off";
  context.beginPath();
  context.arc(x, y, 10, 0, 2 * Math.PI);
  context.globalAlpha = pin.rule === "weak" ? 0.7 : 1;
  context.fillStyle = pin.rule ? MARK_COLOR.rule : measure ? MEASURE : TRANSIT;
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = "#ffffff";
  context.stroke();
  context.font = `700 ${pin.sign.length > 1 ? 9 : 12}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = "#ffffff";
  context.fillText(pin.sign, x, y + 0.5);
  context.globalAlpha = 1;
  if (named) tag(context, pin.text, x, y + 21);
}

export function tag(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  context.font = "600 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const width = context.measureText(text).width + 10;
  context.fillStyle = "#22282e";
  context.beginPath();
  context.roundRect(x - width / 2, y - 8, width, 16, 8);
  context.fill();
  context.fillStyle = "#ffffff";
  context.fillText(text, x, y + 0.5);
}
