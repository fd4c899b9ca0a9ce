import { t } from "@lingui/core/macro";

import { inSentence } from "../ui/words";
import type { Bounds, ScenarioDocument } from "../api/types";
import { nth } from "../lists";
import type { Graph } from "../map/graph";
import { laneShape, turnShapes } from "../map/laneShapes";
import type { ScenePin, SegmentStyle } from "../map/scene";
import type { PlaceNames } from "../map/placeNames";
import type { Heads } from "../signals/heads";
import type { Measure } from "./measures";
import { placesOf } from "./measures";
import { join, segmentsBounds } from "./scene";
import { type StationKind, stationsOf, type Study } from "./study";

/** What measures look like on the map. */
export interface MeasureShapes {
  segments: Map<number, SegmentStyle>;
  /** Lanes, and lanes of turns inside their junctions: rings, x and y in turn. */
  rings: Float64Array[];
  pins: ScenePin[];
}

/** Whole segments in their colour, lanes and turns as such, incidents and lights as signs. */
export function measureShapes(
  graph: Graph,
  measures: readonly Measure[],
  lights: Heads | null,
): MeasureShapes {
  const shapes: MeasureShapes = { segments: new Map(), rings: [], pins: [] };
  for (const measure of measures) {
    const pin = pinOf(graph, measure, lights);
    if (pin) shapes.pins.push(pin);
    // The lane of an incident stays open beside it.
    if (measure.kind !== "incident") for (const name of placesOf(measure)) addPlace(shapes, graph, name);
  }
  return shapes;
}

function addPlace({ segments, rings }: MeasureShapes, graph: Graph, name: string): void {
  const row = graph.segmentRow.get(name);
  const ring = row === undefined ? laneShape(graph, name) : null;
  if (row !== undefined) segments.set(row, "measure");
  else if (ring) rings.push(ring);
  else if (name.includes(">")) rings.push(...turnShapes(graph, name));
}

function pinOf(graph: Graph, measure: Measure, lights: Heads | null): ScenePin | null {
  if (measure.kind === "signal_outage") {
    const middle = lights?.middle(measure.junction);
    return middle ? { ...middle, sign: "off", text: measure.id } : null;
  }
  if (measure.kind !== "incident") return null;
  const at = nodeNear(graph, measure.lane, measure.s);
  return at === null
    ? null
    : { x: nth(graph.columns.x, at), y: nth(graph.columns.y, at), sign: "!", text: measure.id };
}

/** The node of a lane that is nearest to so many metres along the road. */
export function nodeNear({ columns }: Graph, key: string, s: number): number | null {
  const lane = columns.lane_keys.indexOf(key);
  if (lane < 0) return null;
  const [first, end] = [nth(columns.first_node, lane), columns.first_node[lane + 1] ?? columns.lane.length];
  let best: number | null = null;
  for (let i = first; i < end; i++)
    if (best === null || Math.abs(nth(columns.s, i) - s) < Math.abs(nth(columns.s, best) - s)) best = i;
  return best;
}

/** A rectangle around all that a measure names; null if the map has none of it. */
export function boundsOfMeasure(graph: Graph, measure: Measure, lights: Heads | null): Bounds | null {
  const { rings, pins } = measureShapes(graph, [measure], lights);
  const segments = segmentsBounds(graph, placesOf(measure));
  const boxes: Bounds[] = segments ? [segments] : [];
  for (const { x, y } of pins) boxes.push([x, y, x, y]);
  for (const ring of rings)
    for (let k = 0; k + 1 < ring.length; k += 2) {
      const [x, y] = [nth(ring, k), nth(ring, k + 1)];
      boxes.push([x, y, x, y]);
    }
  return boxes.length > 0 ? boxes.reduce(join) : null;
}

/** A letter at each lane that a station crosses: of detectors, sections and cordons. */
export function stationPins(graph: Graph, study: Study): ScenePin[] {
  return stationsOf(study).flatMap(({ id, kind, lines }) =>
    lines.flatMap(({ nodes, word }) =>
      nodes.flatMap((node): ScenePin[] => {
        const place = graph.place(node);
        const text = kind === "detectors" ? id : `${id}: ${inSentence(word)}`;
        return place ? [{ x: place.x, y: place.y, sign: SIGN[kind], text }] : [];
      }),
    ),
  );
}

const SIGN: Record<StationKind, string> = { detectors: "D", sections: "S", cordons: "C" };

/** Stops, and where lines set off and end. */
export function transitPins(graph: Graph, { stops, lines }: ScenarioDocument["transit"]): ScenePin[] {
  const pin = (node: string | null, sign: string, text: string): ScenePin[] => {
    const place = node === null ? undefined : graph.place(node);
    return place ? [{ x: place.x, y: place.y, sign, text }] : [];
  };
  return [
    ...stops.flatMap(({ id, name, node }) => pin(node, "H", name || id)),
    ...lines.flatMap(({ id, start, goal }) => [
      ...pin(start, "▸", t`Line ${id}`),
      ...pin(goal, "■", t`Line ${id} ends`),
    ]),
  ];
}

/** A sign in the middle of each junction with a traffic light. */
export const lightPins = (lights: Heads | null, names: PlaceNames): ScenePin[] =>
  (lights?.junctions ?? []).flatMap((junction): ScenePin[] => {
    const middle = lights?.middle(junction);
    return middle ? [{ ...middle, sign: "L", text: names.junction(junction) }] : [];
  });
