import type { Bounds } from "../api/types";
import { nth } from "../lists";
import type { Palette } from "./colors";
import { type Lines, type PackedDrawing, type PackedLines, tiles, unpack } from "./drawing";
import type { MapLayers } from "./mapLayers";
import { type PathMaker, screenPath } from "./svg";
import type { Underlay } from "./underlay";
import { overlaps, type Size, type View, visible, worldTransform } from "./view";

interface TilePath {
  bounds: Bounds;
  path: Path2D;
}

type Look =
  | { what: "area"; kind: string }
  | { what: "mark"; color: string; width: number; dash: [number, number] | null }
  | { what: "crosswalk" | "bar" | "stopLine" | "building" | "parking" };

interface Item {
  look: Look;
  tiles: TilePath[];
}

const CELL = 120;

/** The map itself: what does not change while it is looked at. */
export class BaseLayer {
  private readonly items: Item[];
  underlay: Underlay | null = null;
  /** How much the roads hide of the picture under them, 0 to 1. */
  roads = 1;

  constructor(
    private readonly drawing: PackedDrawing,
    newPath: PathMaker = screenPath,
  ) {
    const item = (look: Look, packed: PackedLines, closed: boolean): Item =>
      itemOf(look, packed, closed, newPath);
    const levels = new Set([...drawing.areas, ...drawing.marks].map((one) => one[0]));
    this.items = [item({ what: "building" }, drawing.buildings, true)];
    for (const level of [...levels].sort((a, b) => a - b)) {
      for (const [at, kind, rings] of drawing.areas) {
        if (at === level) this.items.push(item({ what: "area", kind }, rings, true));
      }
      if (level === Math.min(...levels)) this.items.push(...furniture(drawing, item));
      for (const [at, color, width, dash, lines] of drawing.marks) {
        if (at === level) this.items.push(item({ what: "mark", color, width, dash }, lines, false));
      }
    }
  }

  draw(
    context: CanvasRenderingContext2D,
    view: View,
    size: Size,
    ratio: number,
    palette: Palette,
    shown: Pick<MapLayers, "signs" | "buildings">,
  ): void {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = palette.land;
    context.fillRect(0, 0, context.canvas.width, context.canvas.height);
    worldTransform(context, view, size, ratio);
    context.lineJoin = "round";
    const seen = visible(view, size);
    if (this.underlay) drawUnderlay(context, this.underlay);
    for (const one of this.items) {
      if (one.look.what === "building" && !shown.buildings) continue;
      if (!style(context, one.look, view.scale, palette)) continue;
      context.globalAlpha = this.underlay && one.look.what !== "mark" ? this.roads : 1;
      for (const tile of one.tiles) {
        if (overlaps(tile.bounds, seen)) paint(context, one.look, tile.path);
      }
    }
    context.globalAlpha = 1;
    context.setLineDash([]);
    if (shown.signs) this.drawSymbols(context, view, size, ratio);
  }

  private drawSymbols(context: CanvasRenderingContext2D, view: View, size: Size, ratio: number): void {
    const [x0, y0, x1, y1] = visible(view, size);
    const pixels = Math.min(Math.max(view.scale * 2.2, 7), 24);
    for (const [kind, x, y, , text] of this.drawing.symbols) {
      if (x < x0 || x > x1 || y < y0 || y > y1) continue;
      if (kind === "speed_limit" && view.scale < 2.5) continue;
      const k = (pixels * ratio) / 24;
      const sx = ((x - view.x) * view.scale + size.width / 2) * ratio;
      const sy = ((view.y - y) * view.scale + size.height / 2) * ratio;
      context.setTransform(k, 0, 0, k, sx, sy);
      symbol(context, kind, text);
    }
  }
}

/** The context is in metres; a picture has its rows downwards. */
function drawUnderlay(context: CanvasRenderingContext2D, { image, width, height, affine }: Underlay): void {
  const [a = 1, b = 0, c = 0, d = 0, e = -1, f = 0] = affine;
  context.save();
  context.transform(a, d, b, e, c, f);
  context.drawImage(image, 0, 0, width, height);
  context.restore();
}

function furniture(
  drawing: PackedDrawing,
  item: (look: Look, packed: PackedLines, closed: boolean) => Item,
): Item[] {
  return [
    item({ what: "parking" }, drawing.parking_spaces, true),
    item({ what: "bar" }, drawing.bars, true),
    item({ what: "crosswalk" }, drawing.crosswalks, true),
    item({ what: "stopLine" }, drawing.stop_lines, false),
  ];
}

function itemOf(look: Look, packed: PackedLines, closed: boolean, newPath: PathMaker): Item {
  const lines = unpack(packed);
  return {
    look,
    tiles: tiles(lines, CELL).map(({ bounds, rows }) => ({
      bounds,
      path: pathOf(lines, rows, closed, newPath()),
    })),
  };
}

function pathOf(lines: Lines, rows: number[], closed: boolean, path: Path2D): Path2D {
  for (const k of rows) {
    for (let i = nth(lines.start, k); i < nth(lines.start, k + 1); i++) {
      if (i === lines.start[k]) path.moveTo(nth(lines.xy, 2 * i), nth(lines.xy, 2 * i + 1));
      else path.lineTo(nth(lines.xy, 2 * i), nth(lines.xy, 2 * i + 1));
    }
    if (closed) path.closePath();
  }
  return path;
}

/** Sets colours and widths; false if the thing is too small to be seen at this scale. */
function style(context: CanvasRenderingContext2D, look: Look, scale: number, palette: Palette): boolean {
  context.setLineDash([]);
  context.lineCap = "butt";
  switch (look.what) {
    case "area":
      context.fillStyle = palette.areas[look.kind] ?? palette.otherArea;
      // A hair of stroke closes the seams between rings that touch.
      context.strokeStyle = context.fillStyle;
      context.lineWidth = 0.5 / scale;
      return true;
    case "mark": {
      const known = palette.marks[look.color] ?? look.color;
      context.strokeStyle = known;
      context.lineWidth = Math.max(look.width, 0.55 / scale);
      if (look.dash) context.setLineDash(look.dash);
      return look.color === "bridge" || scale > (look.dash ? 1.8 : 0.8);
    }
    case "crosswalk":
      context.fillStyle = palette.crosswalk;
      context.strokeStyle = "#7a6ee0";
      context.lineWidth = Math.max(0.12, 0.8 / scale);
      return true;
    case "bar":
      context.fillStyle = palette.bar;
      return scale > 1.5;
    case "stopLine":
      context.strokeStyle = palette.stopLine;
      context.lineWidth = Math.max(0.4, 0.8 / scale);
      return scale > 0.8;
    case "building":
      context.fillStyle = palette.building;
      return true;
    case "parking":
      context.strokeStyle = palette.parking;
      context.lineWidth = Math.max(0.1, 0.5 / scale);
      return scale > 1.5;
  }
}

function paint(context: CanvasRenderingContext2D, look: Look, path: Path2D): void {
  const filled = look.what !== "mark" && look.what !== "stopLine" && look.what !== "parking";
  if (filled) context.fill(path);
  if (look.what !== "bar" && look.what !== "building") context.stroke(path);
}

/** A light or sign in a box of 24 by 24 around the origin. */
function symbol(c: CanvasRenderingContext2D, kind: string, text: string): void {
  if (kind === "traffic_light" || kind === "pedestrian_light") {
    c.fillStyle = "#ffffff";
    c.fillRect(-6, -12.5, 12, 25);
    c.fillStyle = "#22262b";
    c.fillRect(-5, -11.5, 10, 23);
    const lamps = kind === "traffic_light" ? ["#ff4b3e", "#ffc93c", "#35c46a"] : ["#ff4b3e", "#35c46a"];
    lamps.forEach((color, n) => disc(c, 0, (n - (lamps.length - 1) / 2) * 7, 2.7, color));
    return;
  }
  if (kind === "stop") {
    c.fillStyle = "#c8102e";
    c.strokeStyle = "#ffffff";
    c.lineWidth = 2;
    polygon(c, 8, 11, Math.PI / 8);
  } else if (kind === "yield") {
    c.fillStyle = "#ffffff";
    c.strokeStyle = "#c8102e";
    c.lineWidth = 3;
    polygon(c, 3, 11, Math.PI / 2);
  } else {
    disc(c, 0, 0, 12, "#c8102e");
    disc(c, 0, 0, 9, "#ffffff");
    c.fillStyle = "#22262b";
    c.font = "bold 9px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText(text, 0, 0.5);
  }
}

function disc(c: CanvasRenderingContext2D, x: number, y: number, r: number, color: string): void {
  c.fillStyle = color;
  c.beginPath();
  c.arc(x, y, r, 0, 2 * Math.PI);
  c.fill();
}

function polygon(c: CanvasRenderingContext2D, corners: number, r: number, turn: number): void {
  c.beginPath();
  for (let k = 0; k < corners; k++) {
    const a = turn + (2 * Math.PI * k) / corners;
    c.lineTo(r * Math.cos(a), r * Math.sin(a));
  }
  c.closePath();
  c.fill();
  c.stroke();
}
