import type { RefObject } from "react";

import type { Actor, Bounds, Flow, Problem, ScenarioDocument } from "../api/types";
import type { Graph, Place } from "../map/graph";
import type { MapHandle } from "../map/MapCanvas";
import type { Heads } from "../signals/heads";
import type { Measure } from "./measures";
import type { Rule } from "./rules/draft";
import { boundsOfRule } from "./rules/ruleShapes";
import { boundsOfPlaces, boundsOfProblem, segmentsBounds } from "./scene";
import { boundsOfMeasure } from "./sceneParts";

/** Brings parts of the map into sight. */
export interface Sights {
  bounds: (bounds: Bounds) => void;
  segments: (segments: readonly string[]) => void;
  /** A start, at the scale that the map has; it stays where it is if it shows that already. */
  start: (one: Actor | Flow) => void;
  /** A start, near enough to see it. */
  close: (one: Actor | Flow) => void;
  /** A start together with all goals that can be reached from it. */
  goals: (one: Actor | Flow, goals: readonly Place[]) => void;
  /** Nodes, all of them. */
  nodes: (nodes: readonly string[]) => void;
  /** All places of a measure. */
  measure: (measure: Measure) => void;
  /** All places of a rule, and the start of who acts. */
  rule: (rule: Rule, actors: readonly Actor[]) => void;
  problem: (problem: Problem, document: ScenarioDocument) => void;
  /** The rectangle that is in sight. */
  seen: () => Bounds | null;
  /** The point in the middle of it. */
  middle: () => { x: number; y: number } | null;
  /** Acts on what is in the middle, as a click there does. */
  pickMiddle: () => void;
}

/** Metres around what is shown. */
const MARGIN = 25;

/** A rectangle with so many metres more at each side. */
export const around = ([x0, y0, x1, y1]: Bounds, by = MARGIN): Bounds => [x0 - by, y0 - by, x1 + by, y1 + by];

export function sightsOf(
  handle: RefObject<MapHandle | null>,
  graph: Graph,
  lights: () => Heads | null,
): Sights {
  const show = (bounds: Bounds | null): void => {
    if (bounds) handle.current?.show(bounds);
  };
  return {
    bounds: show,
    segments: (segments) => show(segmentsBounds(graph, segments)),
    start: (one) => {
      const place = graph.place(one.spawn);
      if (place) handle.current?.reveal(place.x, place.y);
    },
    close: (one) => {
      const place = graph.place(one.spawn);
      if (place) handle.current?.centre(place.x, place.y);
    },
    goals: (one, goals) => {
      const start = graph.place(one.spawn);
      if (start) show(boundsOfPlaces([start, ...goals]));
    },
    nodes: (nodes) => {
      const places = nodes.flatMap((id) => graph.place(id) ?? []);
      if (places.length > 0) show(around(boundsOfPlaces(places)));
    },
    measure: (measure) => {
      const bounds = boundsOfMeasure(graph, measure, lights());
      if (bounds) show(around(bounds));
    },
    rule: (rule, actors) => {
      const bounds = boundsOfRule(graph, rule, [...actors]);
      if (bounds) show(around(bounds));
    },
    problem: (problem, document) => show(boundsOfProblem(problem, graph, document)),
    seen: () => handle.current?.seen() ?? null,
    middle: () => {
      const seen = handle.current?.seen();
      return seen ? { x: (seen[0] + seen[2]) / 2, y: (seen[1] + seen[3]) / 2 } : null;
    },
    pickMiddle: () => handle.current?.pickMiddle(),
  };
}
