import { nth } from "../lists";
import type { Crowd, Frame } from "../run/frames";

/** Seconds; nothing later is looked for. */
export const SEEN = 6;
/** From here on an encounter is serious, seconds (FHWA-RD-03-050). */
export const SERIOUS = 1.5;

/** A body on the ground: its centre in metres, heading in radians, speed in m/s. */
export interface Body {
  x: number;
  y: number;
  hdg: number;
  speed: number;
  length: number;
  width: number;
}

/** Time to collision of one road user with the one that it would meet first. */
export interface Nearest {
  time: number;
  /** Seconds; null if it meets no other within {@link SEEN}. */
  ttc: number | null;
  other: string | null;
}

/**
 * Seconds until two bodies touch if neither changes its speed or heading; null if not within `most`.
 *
 * Two rectangles that move without turning overlap while their shadows overlap on the axes of both
 * (separating axes): on an axis n that is while |d·n + t v·n| < r, with d and v the distance and the
 * relative velocity of the centres, and r the sum of the half shadows.
 */
export function timeToCollision(one: Body, other: Body, most = SEEN): number | null {
  const [dx, dy] = [other.x - one.x, other.y - one.y];
  const vx = other.speed * Math.cos(other.hdg) - one.speed * Math.cos(one.hdg);
  const vy = other.speed * Math.sin(other.hdg) - one.speed * Math.sin(one.hdg);
  const far = Math.hypot(dx, dy) - (one.length + one.width + other.length + other.width) / 2;
  if (far > most * Math.hypot(vx, vy)) return null;
  let [enter, leave] = [0, most];
  for (const turn of [one.hdg, one.hdg + Math.PI / 2, other.hdg, other.hdg + Math.PI / 2]) {
    const [nx, ny] = [Math.cos(turn), Math.sin(turn)];
    const [p, q] = [dx * nx + dy * ny, vx * nx + vy * ny];
    const r = shadow(one, turn) + shadow(other, turn);
    if (Math.abs(q) < 1e-9) {
      if (Math.abs(p) >= r) return null;
      continue;
    }
    const [a, b] = [(-r - p) / q, (r - p) / q];
    enter = Math.max(enter, Math.min(a, b));
    leave = Math.min(leave, Math.max(a, b));
    if (enter > leave) return null;
  }
  return enter;
}

/** Half of what a body covers in a direction, metres. */
function shadow({ hdg, length, width }: Body, turn: number): number {
  const angle = hdg - turn;
  return (length * Math.abs(Math.cos(angle)) + width * Math.abs(Math.sin(angle))) / 2;
}

/** With whom a road user would collide first, of all in a frame; null if it is not in it. */
export function nearestOf(frame: Frame, crowd: Crowd, id: string): Nearest | null {
  const bodies: (Body & { id: string })[] = [];
  let own: Body | null = null;
  for (let k = 0; k < frame.count; k++) {
    const at = 6 * k;
    const who = crowd.named(nth(frame.rows, at));
    if (!who) continue;
    const body = {
      id: who.id,
      x: nth(frame.rows, at + 1),
      y: nth(frame.rows, at + 2),
      hdg: nth(frame.rows, at + 3),
      speed: nth(frame.rows, at + 4),
      length: who.length,
      width: who.width,
    };
    if (who.id === id) own = body;
    else bodies.push(body);
  }
  if (!own) return null;
  let [ttc, other]: [number | null, string | null] = [null, null];
  for (const body of bodies) {
    const found = timeToCollision(own, body, ttc ?? SEEN);
    if (found !== null && (ttc === null || found < ttc)) [ttc, other] = [found, body.id];
  }
  return { time: frame.time, ttc, other };
}

/** Path of a line through the values that there are: 0 s at the bottom, {@link SEEN} at the top. */
export function linePath(
  points: readonly Nearest[],
  x: (time: number) => number,
  height: number,
  gap: number,
): string {
  let path = "";
  let before: number | null = null;
  for (const { time, ttc } of points) {
    if (ttc === null) before = null;
    else {
      const y = height - (Math.min(ttc, SEEN) / SEEN) * height;
      path += `${before !== null && time - before <= gap ? "L" : "M"}${x(time).toFixed(1)} ${y.toFixed(1)}`;
      // A single value is seen as well.
      if (before === null) path += "h1";
      before = time;
    }
  }
  return path;
}

/** The last point that is not after a time, unless that is long ago. */
export function pointAt(points: readonly Nearest[], time: number, gap: number): Nearest | null {
  let [low, high] = [0, points.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (nth(points, middle).time <= time + 1e-6) low = middle + 1;
    else high = middle;
  }
  const found = points[low - 1];
  return found && time - found.time <= gap ? found : null;
}
