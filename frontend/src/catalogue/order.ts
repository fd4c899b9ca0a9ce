import type { MapInfo } from "../api/types";

export type Order = "name" | "large" | "junctions" | "crosswalks" | "lights";
export const ORDERS: { value: Order; label: string }[] = [
  { value: "name", label: "Name" },
  { value: "large", label: "Most lanes" },
  { value: "junctions", label: "Most junctions" },
  { value: "crosswalks", label: "Most crosswalks" },
  { value: "lights", label: "Most traffic lights" },
];

const FIGURE: Record<Exclude<Order, "name">, (map: MapInfo) => number> = {
  large: (map) => map.statistics.driving_lane_length,
  junctions: (map) => map.statistics.junctions,
  crosswalks: (map) => map.statistics.crosswalks,
  lights: (map) => map.statistics.traffic_lights,
};

/** The maps whose name has all words of `search`, in order. */
export function arranged(maps: readonly MapInfo[], search: string, order: Order): MapInfo[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const found = maps.filter((map) => words.every((word) => map.name.toLowerCase().includes(word)));
  const byName = (a: MapInfo, b: MapInfo): number =>
    a.name.localeCompare(b.name, "en", { numeric: true });
  if (order === "name") return found.sort(byName);
  return found.sort((a, b) => FIGURE[order](b) - FIGURE[order](a) || byName(a, b));
}
