import { nth } from "../lists";
import type { LoadedGraph } from "../map/loaded";

/** Lanes that cross, or lead the other way, are not driven on. */
const COS_ALONG = Math.cos(Math.PI / 3);

/** The nearest node of a lane that leads where one with this heading does, within `reach` metres. */
export function nodeUnder(
  { graph: { columns }, picker }: LoadedGraph,
  x: number,
  y: number,
  hdg: number,
  reach: number,
): number | null {
  let best: number | null = null;
  let least = reach;
  for (const node of picker.within(x - reach, y - reach, x + reach, y + reach, false)) {
    if (Math.cos(nth(columns.hdg, node) - hdg) < COS_ALONG) continue;
    const away = Math.hypot(nth(columns.x, node) - x, nth(columns.y, node) - y);
    if (away < least) [best, least] = [node, away];
  }
  return best;
}
