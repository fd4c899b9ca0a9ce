import type { Bounds } from "../api/types";

/**
 * What part of the map is seen: `x`, `y` is the world point in the middle of the canvas, `scale` is
 * CSS pixels per metre. World y points north, screen y down.
 */
export interface View {
  x: number;
  y: number;
  scale: number;
}

export interface Size {
  width: number;
  height: number;
}

export const MAX_SCALE = 80;

export function toScreen(view: View, size: Size, x: number, y: number): [number, number] {
  return [(x - view.x) * view.scale + size.width / 2, (view.y - y) * view.scale + size.height / 2];
}

/** Inverse of {@link toScreen}. */
export function toWorld(view: View, size: Size, sx: number, sy: number): [number, number] {
  return [(sx - size.width / 2) / view.scale + view.x, view.y - (sy - size.height / 2) / view.scale];
}

/** The view that shows all of `bounds` with a margin as a share of the canvas. */
export function fit(bounds: Bounds, size: Size, margin = 0.05): View {
  const [x0, y0, x1, y1] = bounds;
  const room = 1 - 2 * margin;
  const scale = Math.min(
    (size.width * room) / Math.max(x1 - x0, 1),
    (size.height * room) / Math.max(y1 - y0, 1),
    MAX_SCALE,
  );
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: Math.max(scale, 1e-4) };
}

export function panBy(view: View, dx: number, dy: number): View {
  return { ...view, x: view.x - dx / view.scale, y: view.y + dy / view.scale };
}

/** Zooms by `factor` and keeps the world point under the screen point where it is. */
export function zoomAt(
  view: View,
  size: Size,
  factor: number,
  sx: number,
  sy: number,
  minScale: number,
): View {
  const scale = Math.min(Math.max(view.scale * factor, minScale), MAX_SCALE);
  const [x, y] = toWorld(view, size, sx, sy);
  return {
    scale,
    x: x - (sx - size.width / 2) / scale,
    y: y + (sy - size.height / 2) / scale,
  };
}

/** Keeps the middle of the view on the map, so that the map is never lost. */
export function clampTo(view: View, bounds: Bounds): View {
  const [x0, y0, x1, y1] = bounds;
  return {
    ...view,
    x: Math.min(Math.max(view.x, x0), x1),
    y: Math.min(Math.max(view.y, y0), y1),
  };
}

export function visible(view: View, size: Size): Bounds {
  const w = size.width / 2 / view.scale;
  const h = size.height / 2 / view.scale;
  return [view.x - w, view.y - h, view.x + w, view.y + h];
}

export const overlaps = (a: Bounds, b: Bounds): boolean =>
  a[0] <= b[2] && a[2] >= b[0] && a[1] <= b[3] && a[3] >= b[1];

/** Makes a canvas draw in metres. */
export function worldTransform(
  context: CanvasRenderingContext2D,
  view: View,
  size: Size,
  pixelRatio: number,
): void {
  const k = view.scale * pixelRatio;
  context.setTransform(
    k,
    0,
    0,
    -k,
    (size.width / 2) * pixelRatio - view.x * k,
    (size.height / 2) * pixelRatio + view.y * k,
  );
}
