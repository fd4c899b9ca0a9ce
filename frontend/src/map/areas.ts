import type { Bounds } from "../api/types";
import { nth } from "../lists";

/** An area of the map: whether a point lies in it; metres. */
export type Area = (x: number, y: number) => boolean;

export const inBounds =
  ([x0, y0, x1, y1]: Bounds): Area =>
  (x, y) =>
    x >= x0 && x <= x1 && y >= y0 && y <= y1;

export const inCircle =
  (middle: { x: number; y: number }, radius: number): Area =>
  (x, y) =>
    Math.hypot(x - middle.x, y - middle.y) <= radius;

/** Inside a line that is closed from its end to its begin; where it crosses itself, by even and odd. */
export const inRing =
  (points: readonly (readonly [number, number])[]): Area =>
  (x, y) => {
    let inside = false;
    for (let k = 0; k < points.length; k++) {
      const [ax, ay] = nth(points, k);
      const [bx, by] = nth(points, (k + 1) % points.length);
      if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
    }
    return inside;
  };
