import { useMemo } from "react";

import type { Actor, Flow } from "../api/types";
import type { Place } from "../map/graph";
import type { Scene } from "../map/scene";
import { sceneDetectors } from "../signals/sceneDetectors";
import type { Tool } from "./handlers/handler";
import { ruleShapes } from "./rules/ruleShapes";
import { laneFacts } from "./placeWords";
import { segmentStyles, type Step } from "./scene";
import { lightPins, measureShapes, stationPins, transitPins } from "./sceneParts";
import { viasOf } from "./placing";
import type { EditorNow } from "./useEditing";

/** Steps in which measures are drawn, and stops and lines. */
const MEASURED: ReadonlySet<Step> = new Set<Step>(["traffic", "measures", "run"]);
/** In which rules are drawn. */
const RULED: ReadonlySet<Step> = new Set<Step>(["rules", "run"]);
const SERVED: ReadonlySet<Step> = new Set<Step>(["traffic", "transit", "run"]);

/**
 * Goals that are suggested on the map: while one is chosen, or of who has none yet.
 *
 * With something else in the hand they would hide the starts, and a hundred of them the goal that is set.
 */
export const suggestedGoals = (
  tool: Pick<Tool, "goals"> | null,
  one: Pick<Actor | Flow, "goal"> | null | undefined,
  goals: readonly Place[] | null,
): readonly Place[] => ((tool ? tool.goals : !one?.goal) ? (goals ?? []) : []);

/** What the map shows of the editor as it is now. */
export function useScene(now: EditorNow): Scene {
  const {
    graph,
    document: { roi, measures, study, transit, rules, actors: placed },
    drafted,
    region: { candidates },
    step,
    tool,
    handler: { walks, badge },
    hover,
    inside,
    actors,
    flows,
    goals,
    one,
    route,
    lights,
    program,
    pick,
  } = now;
  const shapes = useMemo(() => measureShapes(graph, measures, lights), [graph, measures, lights]);
  const stops = useMemo(() => transitPins(graph, transit), [graph, transit]);
  const ruled = useMemo(
    () => ruleShapes(graph, { rules, actors: placed }, drafted),
    [graph, rules, placed, drafted],
  );
  const stations = useMemo(() => stationPins(graph, study), [graph, study]);
  const signals = useMemo(() => lightPins(lights, graph.names), [lights, graph]);
  const detectors = useMemo(() => sceneDetectors(program), [program]);
  return useMemo<Scene>(() => {
    const placing = step === "actors";
    const pointing = placing || pick.now !== null;
    const measured = MEASURED.has(step);
    const served = SERVED.has(step);
    const studied = step === "study" || step === "run";
    const place = hover?.is === "place" ? hover.place : null;
    return {
      segments: measured ? shapes.segments : segmentStyles(graph, roi, candidates, step === "region"),
      lanes: measured ? shapes.rings : [],
      pins: [
        ...(measured ? shapes.pins : []),
        ...(served ? stops : []),
        ...(step === "lights" ? signals : []),
        ...(studied ? stations : []),
        ...(RULED.has(step) ? ruled.pins : []),
      ],
      lines: RULED.has(step) ? ruled.lines : [],
      detectors:
        hover?.is === "loop"
          ? [...detectors, { place: hover.place, label: "", bus: false, occupied: true }]
          : detectors,
      hoverSegment: hover?.is === "segment" ? hover.row : null,
      nodes: {
        vehicles: step !== "region" && (!placing || walks !== true),
        walks: step !== "region" && (!placing || walks !== false),
        inside: placing ? inside : null,
      },
      actors,
      flows,
      goals: placing ? suggestedGoals(tool, one, goals) : [],
      chosenGoal: placing && one?.goal ? (graph.place(one.goal) ?? null) : null,
      route: placing ? route : [],
      waypoints: placing && one ? viasOf(one).flatMap((id) => graph.place(id) ?? []) : [],
      hover: pointing ? place : null,
      hoverText: placing && place ? laneFacts(graph, place.id) : null,
      hoverCategory: badge,
    };
  }, [
    graph,
    roi,
    shapes,
    stops,
    ruled,
    stations,
    signals,
    detectors,
    candidates,
    step,
    tool,
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
