import { useMemo } from "react";

import type { Scene } from "../map/scene";
import { laneFacts } from "./placeWords";
import { measureStyles, segmentStyles } from "./scene";
import type { EditorNow } from "./useEditing";

/** What the map shows of the editor as it is now. */
export function useScene(now: EditorNow): Scene {
  const {
    graph,
    document: { roi, measures },
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
  } = now;
  return useMemo<Scene>(() => {
    const placing = step === "actors";
    const place = hover?.is === "place" ? hover.place : null;
    return {
      segments:
        step === "traffic" || step === "run"
          ? measureStyles(graph, measures)
          : segmentStyles(graph, roi, candidates, step === "region"),
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
      hover: placing ? place : null,
      hoverText: placing && place ? laneFacts(graph, place.id) : null,
      hoverCategory: badge,
    };
  }, [graph, roi, measures, candidates, step, hover, walks, badge, inside, actors, flows, goals, one, route]);
}
