import { t } from "@lingui/core/macro";

import { lengthText, speedText } from "../language/units";
import { localized } from "../language/localized";
import { nth } from "../lists";
import type { Graph } from "../map/graph";

/** A place in words: road, lane and metres along it. */
export function placeWord(graph: Graph, id: string): string {
  const place = graph.place(id);
  if (!place) return id;
  const [first] = graph.lanePlaces(place);
  const { columns } = graph;
  const metres = place.walk ? (place.index - first) * columns.spacing : nth(columns.s, place.index);
  return `${laneWord(graph, id)}, ${lengthText(metres)}`;
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
  const left = lane > 0;
  const number = Math.abs(lane);
  const junction = place.walk ? null : nth(columns.lane_junctions, nth(columns.lane, place.index));
  if (junction !== null) return t`Junction ${junction}, road ${road}, lane ${number}`;
  if (Number.isNaN(lane) || !road) return place.walk ? t`Walkway ${key}` : t`Lane ${key}`;
  if (place.walk) return left ? t`Road ${road}, left walkway` : t`Road ${road}, right walkway`;
  return left ? t`Road ${road}, left lane ${number}` : t`Road ${road}, right lane ${number}`;
}

/** What is to be known of the lane under the pointer: kind, width and limit. */
export function laneFacts(graph: Graph, id: string): string {
  const place = graph.place(id);
  if (!place) return "";
  const { columns } = graph;
  if (place.walk) return t`Walkway, ${lengthText(nth(columns.walks.width, place.index), 1)} wide`;
  const kind = nth(columns.lane_types, nth(columns.lane, place.index));
  const width = lengthText(nth(columns.width, place.index), 1);
  const limit = nth(columns.speed_limit, place.index);
  return t`${laneKind(kind)}, ${width} wide, ${limit === null ? t`no limit` : t`limit ${speedText(limit)}`}`;
}

/** The kind of a lane in words. */
export const laneKind = (type: string): string => KIND()[type] ?? t`Lane`;

const KIND = localized((): Record<string, string> => ({
  driving: t`Driving lane`,
  biking: t`Bicycle lane`,
  bidirectional: t`Lane for both directions`,
  entry: t`Entry lane`,
  exit: t`Exit lane`,
  onRamp: t`On-ramp`,
  offRamp: t`Off-ramp`,
  bus: t`Bus lane`,
  taxi: t`Taxi lane`,
  HOV: t`Carpool lane`,
  sidewalk: t`Sidewalk`,
  walking: t`Sidewalk`,
  parking: t`Parking lane`,
  shoulder: t`Shoulder`,
  restricted: t`Closed lane`,
}));
