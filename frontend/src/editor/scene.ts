import type { Actor, Assets, Bounds, Problem, ScenarioDocument } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { segmentBounds } from "../map/graph";
import type { SceneActor, SegmentStyle } from "../map/scene";

export type Step = "map" | "region" | "environment" | "actors" | "run";
export const STEPS: readonly Step[] = ["map", "region", "environment", "actors", "run"];

/** How each segment is drawn: the first of the region dark blue, what may be added light blue. */
export function segmentStyles(
  graph: Graph, roi: readonly string[], candidates: readonly string[], growing: boolean,
): Map<number, SegmentStyle> {
  const styles = new Map<number, SegmentStyle>();
  const put = (id: string, style: SegmentStyle): void => {
    const row = graph.segmentRow.get(id);
    if (row !== undefined) styles.set(row, style);
  };
  // With no region yet everything may be chosen: nothing stands out.
  if (growing && roi.length > 0) for (const id of candidates) put(id, "eligible");
  if (growing) roi.forEach((id, n) => put(id, n === 0 ? "base" : "member"));
  return styles;
}

export function insideRows(graph: Graph, roi: readonly string[]): Set<number> {
  return new Set(roi.flatMap((id) => graph.segmentRow.get(id) ?? []));
}

/** Length and width in metres: of the model, or what is usual for the kind. */
export function bodyOf(actor: Pick<Actor, "category" | "model">, assets: Assets | null): [number, number] {
  const found = assets?.blueprints.find((one) => one.id === actor.model)
    ?? assets?.categories.find((one) => one.category === actor.category);
  return found ? [found.length, found.width] : [4, 1.8];
}

/** Index of the actor that a problem is about, from a place such as `actors[3].goal`. */
export function actorOfProblem(problem: Problem, actors: readonly Actor[]): Actor | null {
  const found = /^actors\[(\d+)\]/.exec(problem.where);
  return found ? (actors[Number(found[1])] ?? null) : null;
}

export function sceneActors(
  graph: Graph, document: ScenarioDocument, assets: Assets | null, selection: readonly string[],
  problems: readonly Problem[],
): SceneActor[] {
  const wrong = new Set(problems.filter((one) => one.severity === "error")
    .map((one) => actorOfProblem(one, document.actors)?.id));
  return document.actors.flatMap((actor) => {
    const place = graph.place(actor.spawn);
    if (!place) return [];
    const [length, width] = bodyOf(actor, assets);
    return [{
      id: actor.id, category: actor.category, hdg: place.hdg, length, width, ego: actor.ego,
      // The offset is to the left of the driving direction.
      x: place.x - actor.lateral_offset * Math.sin(place.hdg),
      y: place.y + actor.lateral_offset * Math.cos(place.hdg),
      selected: selection.includes(actor.id), problem: wrong.has(actor.id),
    }];
  });
}

export function nearestActor(
  actors: readonly SceneActor[], x: number, y: number, reach: number,
): SceneActor | null {
  let best: SceneActor | null = null;
  let least = Infinity;
  for (const actor of actors) {
    const away = Math.hypot(actor.x - x, actor.y - y);
    if (away <= Math.max(reach, actor.length / 2) && away < least) [best, least] = [actor, away];
  }
  return best;
}

export function nearestPlace(
  places: readonly Place[], x: number, y: number, reach: number,
): Place | null {
  let best: Place | null = null;
  let least = reach;
  for (const place of places) {
    const away = Math.hypot(place.x - x, place.y - y);
    if (away <= least) [best, least] = [place, away];
  }
  return best;
}

/** What to show of the map so that a problem is seen; null if it has no place. */
export function boundsOfProblem(
  problem: Problem, graph: Graph, document: ScenarioDocument,
): Bounds | null {
  const actor = actorOfProblem(problem, document.actors);
  const nodes = [...problem.nodes, ...(actor ? [actor.spawn] : [])];
  const boxes: Bounds[] = nodes.flatMap((id) => {
    const place = graph.place(id);
    return place ? [[place.x - 25, place.y - 25, place.x + 25, place.y + 25] as Bounds] : [];
  });
  if (boxes.length === 0) return segmentsBounds(graph, problem.segments);
  return boxes.reduce(join);
}

export function segmentsBounds(graph: Graph, ids: readonly string[]): Bounds | null {
  const all = segmentBounds(graph.columns);
  const boxes = ids.flatMap((id) => {
    const row = graph.segmentRow.get(id);
    return row === undefined || !Number.isFinite(all[row][0]) ? [] : [all[row]];
  });
  return boxes.length > 0 ? boxes.reduce(join) : null;
}

const join = (a: Bounds, b: Bounds): Bounds => [
  Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[2], b[2]), Math.max(a[3], b[3]),
];

/** The step to begin with when a scenario is opened. */
export function firstStep(document: ScenarioDocument): Step {
  if (document.roi.length === 0) return "region";
  return "actors";
}
