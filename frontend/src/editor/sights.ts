import type { RefObject } from "react";

import type { Actor, Bounds, Flow, Problem, ScenarioDocument } from "../api/types";
import type { Graph, Place } from "../map/graph";
import type { MapHandle } from "../map/MapCanvas";
import { boundsOfPlaces, boundsOfProblem, segmentsBounds } from "./scene";

/** Brings parts of the map into sight. */
export interface Sights {
  bounds: (bounds: Bounds) => void;
  segments: (segments: readonly string[]) => void;
  start: (one: Actor | Flow) => void;
  /** A start together with all goals that can be reached from it. */
  goals: (one: Actor | Flow, goals: readonly Place[]) => void;
  problem: (problem: Problem, document: ScenarioDocument) => void;
  /** Acts on what is in the middle, as a click there does. */
  pickMiddle: () => void;
}

export function sightsOf(handle: RefObject<MapHandle | null>, graph: Graph): Sights {
  const show = (bounds: Bounds | null): void => {
    if (bounds) handle.current?.show(bounds);
  };
  return {
    bounds: show,
    segments: (segments) => show(segmentsBounds(graph, segments)),
    start: (one) => {
      const place = graph.place(one.spawn);
      if (place) handle.current?.centre(place.x, place.y);
    },
    goals: (one, goals) => {
      const start = graph.place(one.spawn);
      if (start) show(boundsOfPlaces([start, ...goals]));
    },
    problem: (problem, document) => show(boundsOfProblem(problem, graph, document)),
    pickMiddle: () => handle.current?.pickMiddle(),
  };
}
