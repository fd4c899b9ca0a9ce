import type { Scenery } from "./scenery";

/** Shares of the distance that an arrow key moves the camera, to the right and ahead. */
const MOVES: Readonly<Record<string, readonly [number, number] | undefined>> = {
  ArrowLeft: [-0.1, 0],
  ArrowRight: [0.1, 0],
  ArrowUp: [0, 0.1],
  ArrowDown: [0, -0.1],
};
const NEARER = 1.3;

/** Moves the camera as a key says; whether it says something. */
export function steer(scenery: Pick<Scenery, "pan" | "zoom">, key: string): boolean {
  const step = MOVES[key];
  if (step) scenery.pan(...step);
  else if (key === "+" || key === "=") scenery.zoom(NEARER);
  else if (key === "-") scenery.zoom(1 / NEARER);
  else return false;
  return true;
}
