import type { GraphColumns } from "../src/api/types";
import { nth } from "../src/lists";
import type { Moving } from "../src/map/scene";

/** What the address of a measured page says. */
export const options = new URLSearchParams(location.search);
export const map = options.get("map") ?? "Town04";

export async function load<T>(path: string): Promise<T> {
  return (await (await fetch(`/api/maps/${encodeURIComponent(map)}/${path}`)).json()) as T;
}

/** Vehicles on nodes of the graph, each moved along its heading. */
export function crowd(columns: GraphColumns, vehicles: number, time: number): Moving {
  const pose = new Float64Array(5 * vehicles);
  const category = new Uint8Array(vehicles);
  for (let i = 0; i < vehicles; i++) {
    const node = Math.floor(i * 7.919 + Math.max(time, 0) * 5) % columns.x.length;
    pose.set([nth(columns.x, node), nth(columns.y, node), nth(columns.hdg, node), 4.8, 1.9], 5 * i);
    category[i] = i % 6;
  }
  return { count: vehicles, pose, category, flags: new Uint8Array(vehicles).fill(3), ego: 0, followed: -1 };
}
