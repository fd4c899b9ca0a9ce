import { t } from "@lingui/core/macro";

import { roughLength } from "../language/units";
import { localized } from "../language/localized";
import type { MapInfo } from "../api/types";

export type Order = "name" | "large" | "small" | "junctions" | "crosswalks" | "lights" | "fast";
export const ORDERS = localized((): { value: Order; label: string }[] => [
  { value: "name", label: t`Name` },
  { value: "large", label: t`Largest` },
  { value: "small", label: t`Smallest` },
  { value: "junctions", label: t`Most junctions` },
  { value: "crosswalks", label: t`Most crosswalks` },
  { value: "lights", label: t`Most traffic lights` },
  { value: "fast", label: t`Highest speed limit` },
]);

const FIGURE: Record<Exclude<Order, "name">, (map: MapInfo) => number> = {
  large: (map) => map.statistics.driving_lane_length,
  small: (map) => -map.statistics.driving_lane_length,
  junctions: (map) => map.statistics.junctions,
  crosswalks: (map) => map.statistics.crosswalks,
  lights: (map) => map.statistics.traffic_lights,
  fast: (map) => map.statistics.speed_limit_max ?? 0,
};

/** Metres of lanes up to which a map is small, and from which it is large. */
const SMALL = 3_000;
const LARGE = 15_000;

export type Wish = "lights" | "crosswalks" | "junctions" | "left" | "small" | "large";
export const WISHES = localized((): { value: Wish; label: string; has: (map: MapInfo) => boolean }[] => [
  { value: "lights", label: t`Traffic lights`, has: ({ statistics }) => statistics.traffic_lights > 0 },
  { value: "crosswalks", label: t`Crosswalks`, has: ({ statistics }) => statistics.crosswalks > 0 },
  { value: "junctions", label: t`Junctions`, has: ({ statistics }) => statistics.junctions > 0 },
  { value: "left", label: t`Left-hand traffic`, has: ({ statistics }) => statistics.rule === "LHT" },
  {
    value: "small",
    label: t`Small (up to ${roughLength(3000)} of lanes)`,
    has: ({ statistics }) => statistics.driving_lane_length <= SMALL,
  },
  {
    value: "large",
    label: t`Large (from ${roughLength(15_000)} of lanes)`,
    has: ({ statistics }) => statistics.driving_lane_length >= LARGE,
  },
]);

/** The maps whose name has all words of `search` and that have all that is wished for, in order. */
export function arranged(
  maps: readonly MapInfo[],
  search: string,
  order: Order,
  wishes: readonly Wish[] = [],
): MapInfo[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const wanted = WISHES().filter(({ value }) => wishes.includes(value));
  const found = maps.filter(
    (map) =>
      words.every((word) => map.name.toLowerCase().includes(word)) && wanted.every(({ has }) => has(map)),
  );
  const byName = (a: MapInfo, b: MapInfo): number => a.name.localeCompare(b.name, "en", { numeric: true });
  if (order === "name") return found.sort(byName);
  return found.sort((a, b) => FIGURE[order](b) - FIGURE[order](a) || byName(a, b));
}
