import { nth } from "../lists";
import type { Graph } from "../map/graph";
import { kmh } from "../ui/words";

/** A place in words: road, lane and metres along it. */
export function placeWord(graph: Graph, id: string): string {
  const place = graph.place(id);
  if (!place) return id;
  const [first] = graph.lanePlaces(place);
  const { columns } = graph;
  const metres = place.walk ? (place.index - first) * columns.spacing : nth(columns.s, place.index);
  return `${laneWord(graph, id)}, ${Math.round(metres)} m`;
}

/** The lane of a place: `Road 4, right lane 1`. */
export function laneWord(graph: Graph, id: string): string {
  const place = graph.place(id);
  if (!place) return id;
  const { columns } = graph;
  const of = place.walk ? columns.walks : columns;
  const key = nth(of.lane_keys, nth(of.lane, place.index));
  const parts = key.split(".");
  const lane = Number(parts.at(-1));
  const road = parts.slice(0, -2).join(".");
  const side = lane > 0 ? "left" : "right";
  const junction = place.walk ? null : nth(columns.lane_junctions, nth(columns.lane, place.index));
  if (junction !== null) return `Junction ${junction}, road ${road}, lane ${Math.abs(lane)}`;
  if (Number.isNaN(lane) || !road) return place.walk ? `Walkway ${key}` : `Lane ${key}`;
  return place.walk ? `Road ${road}, ${side} walkway` : `Road ${road}, ${side} lane ${Math.abs(lane)}`;
}

/** What is to be known of the lane under the pointer: kind, width and limit. */
export function laneFacts(graph: Graph, id: string): string {
  const place = graph.place(id);
  if (!place) return "";
  const { columns } = graph;
  if (place.walk) return `Walkway, ${nth(columns.walks.width, place.index).toFixed(1)} m wide`;
  const kind = nth(columns.lane_types, nth(columns.lane, place.index));
  const width = nth(columns.width, place.index).toFixed(1);
  const limit = nth(columns.speed_limit, place.index);
  return `${KIND[kind] ?? "Lane"}, ${width} m wide, ${limit === null ? "no limit" : `limit ${kmh(limit)}`}`;
}

const KIND: Record<string, string> = {
  driving: "Driving lane",
  biking: "Bicycle lane",
  bidirectional: "Lane for both directions",
  entry: "Entry lane",
  exit: "Exit lane",
  onRamp: "On-ramp",
  offRamp: "Off-ramp",
  bus: "Bus lane",
  taxi: "Taxi lane",
  HOV: "Carpool lane",
};
