import type { ScenePin } from "./scene";

/** Pixels within which signs would hide each other. */
const CELL = 26;

/** Signs that lie so close together that they are drawn as one with their number. */
export interface PinCluster {
  /** Their middle, metres. */
  x: number;
  y: number;
  pins: readonly ScenePin[];
}

/** Signs by where they are at a scale, pixels per metre; those of rules that are looked at stay alone. */
export function clustered(pins: readonly ScenePin[], scale: number): PinCluster[] {
  if (scale === Infinity) return pins.map((pin) => ({ x: pin.x, y: pin.y, pins: [pin] }));
  const size = CELL / scale;
  const cells = new Map<string, ScenePin[]>();
  const alone: ScenePin[] = [];
  for (const pin of pins) {
    if (pin.rule === "strong") {
      alone.push(pin);
      continue;
    }
    const key = `${Math.floor(pin.x / size)} ${Math.floor(pin.y / size)}`;
    const cell = cells.get(key);
    if (cell) cell.push(pin);
    else cells.set(key, [pin]);
  }
  const mean = (values: readonly number[]): number =>
    values.reduce((sum, value) => sum + value, 0) / values.length;
  return [...cells.values(), ...alone.map((pin) => [pin])].map((of) => ({
    x: mean(of.map(({ x }) => x)),
    y: mean(of.map(({ y }) => y)),
    pins: of,
  }));
}
