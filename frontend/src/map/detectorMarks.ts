import { nth } from "../lists";
import { DETECTOR } from "./colors";
import type { SceneDetector } from "./scene";
import type { View } from "./view";

/** Metres of a loop, and of an area that sees buses, across the lane. */
const LOOP = 2.2;
const BAND = 2.8;
/** Metres between detectors of one name that lie beside each other, at most. */
const NEIGHBOURS = 12;
/** Metres of a waiting place. */
const WAITING = 1.4;

/** Loops as boxes in their lanes, areas for buses as bands, places where people wait as circles. */
export function drawDetectors(
  context: CanvasRenderingContext2D,
  view: View,
  detectors: readonly SceneDetector[],
): void {
  context.strokeStyle = context.fillStyle = DETECTOR;
  context.lineJoin = "round";
  context.setLineDash([]);
  for (const { place, bus, occupied } of detectors) {
    context.beginPath();
    if (place.length < 2) {
      const [x, y] = place[0] ?? [];
      if (x === undefined || y === undefined) continue;
      context.arc(x, y, WAITING, 0, 2 * Math.PI);
    } else {
      const ring = around(place, (bus ? BAND : LOOP) / 2);
      ring.forEach(([x, y], n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
    }
    context.globalAlpha = occupied ? 0.85 : bus ? 0.15 : 0.25;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 2 / view.scale;
    context.stroke();
  }
}

/** Where detectors are named: those of one name that lie beside each other once, at the lowest of them. */
export function detectorNames(
  detectors: readonly SceneDetector[],
): { x: number; y: number; label: string }[] {
  const names: { x: number; y: number; label: string }[] = [];
  for (const { place, label } of detectors) {
    const [x, y] = place[place.length - 1] ?? [];
    if (x === undefined || y === undefined) continue;
    const beside = names.find((one) => one.label === label && Math.hypot(one.x - x, one.y - y) < NEIGHBOURS);
    if (!beside) names.push({ x, y, label });
    else if (y < beside.y) [beside.x, beside.y] = [x, y];
  }
  return names;
}

/** The outline of a band along points, so far to both sides. */
function around(points: SceneDetector["place"], half: number): [number, number][] {
  const left: [number, number][] = [];
  const right: [number, number][] = [];
  points.forEach(([x, y], n) => {
    const [ax, ay] = nth(points, Math.max(n - 1, 0));
    const [bx, by] = nth(points, Math.min(n + 1, points.length - 1));
    const length = Math.hypot(bx - ax, by - ay) || 1;
    const [nx, ny] = [(-(by - ay) / length) * half, ((bx - ax) / length) * half];
    left.push([x + nx, y + ny]);
    right.push([x - nx, y - ny]);
  });
  return [...left, ...right.reverse()];
}
