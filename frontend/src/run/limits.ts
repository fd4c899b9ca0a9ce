import type { LoadedGraph } from "../map/loaded";
import { nodeUnder } from "./onLane";

/** The speed limit at a place for one with this heading, m/s; null where the map has none. */
export type LimitOf = (x: number, y: number, hdg: number) => number | null;

/** Metres from the middle of a lane up to which one is on it. */
const ON_LANE = 3;

/** Limits of the lanes of a map. */
export function limitsOf(loaded: LoadedGraph): LimitOf {
  return (x, y, hdg) => {
    const node = nodeUnder(loaded, x, y, hdg, ON_LANE);
    return node === null ? null : (loaded.graph.columns.speed_limit[node] ?? null);
  };
}
