import type { Category } from "../api/types";

/** From where one looks; `free` is where a drag has left the camera. */
export const CAMERAS = ["above", "behind", "seat"] as const;
export type Camera = (typeof CAMERAS)[number];

export const isCamera = (text: string | null | undefined): text is Camera => CAMERAS.includes(text as Camera);

/** A road user that a camera goes with; slope is its rise per metre ahead. */
export interface Carried {
  x: number;
  y: number;
  z: number;
  hdg: number;
  slope: number;
  length: number;
  width: number;
  category: Category;
}

/** Eyes: shares of a length ahead of the middle and of a width to the left, and metres above the ground. */
const SEAT: Record<Category, { ahead: number; left: number; up: number }> = {
  car: { ahead: 0.05, left: 0.2, up: 1.2 },
  van: { ahead: 0.2, left: 0.2, up: 1.6 },
  truck: { ahead: 0.42, left: 0.2, up: 2.4 },
  bus: { ahead: 0.44, left: 0.2, up: 2.0 },
  motorcycle: { ahead: 0, left: 0, up: 1.45 },
  bicycle: { ahead: 0, left: 0, up: 1.6 },
  pedestrian: { ahead: 0.3, left: 0, up: 1.65 },
};

type Point = readonly [x: number, y: number, z: number];

/** Where a camera is, and what it looks at. */
export interface Stand {
  eye: Point;
  target: Point;
}

/** Vertical angle of sight, degrees. */
export const ANGLE = { above: 40, behind: 50, seat: 62 };

/** Behind and above a road user, all of it in sight. */
export function behind({ x, y, z, hdg, length }: Carried): Stand {
  const [cos, sin] = [Math.cos(hdg), Math.sin(hdg)];
  const back = 7 + 0.9 * length;
  return {
    eye: [x - back * cos, y - back * sin, z + 3 + 0.28 * length],
    target: [x + 8 * cos, y + 8 * sin, z + 0.8],
  };
}

/** What its driver sees, or who walks or rides. */
export function seat({ x, y, z, hdg, slope, length, width, category }: Carried): Stand {
  const { ahead, left, up } = SEAT[category];
  const [cos, sin] = [Math.cos(hdg), Math.sin(hdg)];
  const [along, aside] = [ahead * length, left * width];
  const eye: Point = [x + along * cos - aside * sin, y + along * sin + aside * cos, z + up + along * slope];
  return { eye, target: [eye[0] + 20 * cos, eye[1] + 20 * sin, eye[2] + 20 * slope - 0.8] };
}

/** Over a place that lies in the middle, leaning south by `tilt` radians; exactly above there is no north. */
export function above([x, y, z]: Point, scale: number, pixels: number, tilt: number): Stand {
  const [far, lean] = [heightFor(scale, pixels), Math.max(tilt, 1e-4)];
  return { eye: [x, y - far * Math.sin(lean), z + far * Math.cos(lean)], target: [x, y, z] };
}

/** Height of a camera that looks straight down and shows a metre as `scale` pixels. */
export const heightFor = (scale: number, pixels: number): number =>
  pixels / (2 * scale * Math.tan((ANGLE.above * Math.PI) / 360));
