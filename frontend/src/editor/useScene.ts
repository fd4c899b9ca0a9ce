import { useMemo } from "react";

import type { Scene } from "../map/scene";
import { laneFacts } from "./placeWords";
import { segmentStyles, type Step } from "./scene";
import { measureShapes, transitPins } from "./sceneParts";
import type { EditorNow } from "./useEditing";

/** Steps in which measures are drawn, and stops and lines. */
const MEASURED: ReadonlySet<Step> = new Set<Step>(["traffic", "measures", "run"]);
const SERVED: ReadonlySet<Step> = new Set<Step>(["traffic", "transit", "run"]);

/** What the map shows of the editor as it is now. */
export function useScene(now: EditorNow): Scene {
  const {
    graph,
    document: { roi, measures, transit },
    region: { candidates },
    step,
    handler: { walks, badge },
    hover,
    inside,
    actors,
    flows,
    goals,
    one,
    route,
    lights,
    pick,
  } = now;
  const shapes = useMemo(() => measureShapes(graph, measures, lights), [graph, measures, lights]);
  const stops = useMemo(() => transitPins(graph, transit), [graph, transit]);
  return useMemo<Scene>(() => {
    const placing = step === "actors";
    const pointing = placing || pick.now !== null;
    const measured = MEASURED.has(step);
    const served = SERVED.has(step);
    const place = hover?.is === "place" ? hover.place : null;
    return {
      segments: measured ? shapes.segments : segmentStyles(graph, roi, candidates, step === "region"),
      lanes: measured ? shapes.rings : [],
      pins: [...(measured ? shapes.pins : []), ...(served ? stops : [])],
      hoverSegment: hover?.is === "segment" ? hover.row : null,
      nodes: {
        vehicles: step !== "region" && (!placing || walks !== true),
        walks: step !== "region" && (!placing || walks !== false),
        inside: placing ? inside : null,
      },
      actors,
      flows,
      goals: placing ? (goals ?? []) : [],
      chosenGoal: placing && one?.goal ? (graph.place(one.goal) ?? null) : null,
      route: placing ? route : [],
      hover: pointing ? place : null,
      hoverText: placing && place ? laneFacts(graph, place.id) : null,
      hoverCategory: badge,
    };
  }, [
    graph,
    roi,
    shapes,
    stops,
    candidates,
    step,
    hover,
    walks,
    badge,
    inside,
    actors,
    flows,
    goals,
    one,
    route,
    pick,
  ]);
}
