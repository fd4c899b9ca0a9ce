import type { Actor, Assets, Bounds, Flow, Problem, ScenarioDocument } from "../api/types";
import { bringsTraffic } from "./demand";
import type { Area } from "../map/areas";
import type { Graph, Place } from "../map/graph";
import { segmentBounds } from "../map/graph";
import type { SceneActor, SceneFlow, SegmentStyle } from "../map/scene";

/** The steps of the editor in their groups, both in the order in which one usually goes. */
export const STEP_GROUPS = {
  place: ["map", "region", "environment"],
  traffic: ["actors", "traffic", "transit"],
  control: ["lights", "measures", "rules"],
  evaluate: ["parameters", "study", "criteria", "run"],
} as const;
export type StepGroup = keyof typeof STEP_GROUPS;
export type Step = (typeof STEP_GROUPS)[StepGroup][number];
export const STEPS: readonly Step[] = Object.values(STEP_GROUPS).flat();

/** How each segment is drawn: the first of the region dark blue, what may be added light blue. */
export function segmentStyles(
  graph: Graph,
  roi: readonly string[],
  candidates: readonly string[],
  growing: boolean,
): Map<number, SegmentStyle> {
  const styles = new Map<number, SegmentStyle>();
  const put = (id: string, style: SegmentStyle): void => {
    const row = graph.segmentRow.get(id);
    if (row !== undefined) styles.set(row, style);
  };
  // With no region yet everything may be chosen: nothing is highlighted.
  if (growing && roi.length > 0) for (const id of candidates) put(id, "eligible");
  if (growing) roi.forEach((id, n) => put(id, n === 0 ? "base" : "member"));
  return styles;
}

export function insideRows(graph: Graph, roi: readonly string[]): Set<number> {
  return new Set(roi.flatMap((id) => graph.segmentRow.get(id) ?? []));
}

/** Length and width in metres: of the model, or what is usual for the kind. */
export function bodyOf(
  actor: Pick<Actor, "category" | "model" | "size">,
  assets: Assets | null,
): [number, number] {
  if (actor.size) return [actor.size.length, actor.size.width];
  const found =
    assets?.blueprints.find((one) => one.id === actor.model) ??
    assets?.categories.find((one) => one.category === actor.category);
  return found ? [found.length, found.width] : [4, 1.8];
}

/** Whom a problem is about, from a place such as `actors[3].goal`. */
export function ofProblem(problem: Problem, document: ScenarioDocument): Actor | Flow | null {
  const found = /^(actors|flows)\[(\d+)\]/.exec(problem.where);
  const row = Number(found?.[2]);
  return (found?.[1] === "actors" ? document.actors[row] : document.flows[row]) ?? null;
}

/** Ids of those that cannot be run as they are. */
export const wrongOnes = (problems: readonly Problem[], document: ScenarioDocument): Set<string> =>
  new Set(
    problems.filter((one) => one.severity === "error").flatMap((one) => ofProblem(one, document)?.id ?? []),
  );

export function sceneActors(
  graph: Graph,
  { actors }: Pick<ScenarioDocument, "actors">,
  assets: Assets | null,
  selection: ReadonlySet<string>,
  wrong: ReadonlySet<string>,
): SceneActor[] {
  return actors.flatMap((actor) => {
    const place = graph.place(actor.spawn);
    if (!place) return [];
    const [length, width] = bodyOf(actor, assets);
    const { lateral_offset: left, longitudinal_offset: ahead } = actor;
    return [
      {
        id: actor.id,
        category: actor.category,
        hdg: place.hdg,
        length,
        width,
        ego: actor.ego,
        // The offsets are to the left of the driving direction and along it.
        x: place.x - left * Math.sin(place.hdg) + ahead * Math.cos(place.hdg),
        y: place.y + left * Math.cos(place.hdg) + ahead * Math.sin(place.hdg),
        offset: actor.lateral_offset,
        selected: selection.has(actor.id),
        problem: wrong.has(actor.id),
      },
    ];
  });
}

export function sceneFlows(
  graph: Graph,
  { flows }: Pick<ScenarioDocument, "flows">,
  selection: ReadonlySet<string>,
  wrong: ReadonlySet<string>,
): SceneFlow[] {
  return flows.flatMap((flow) => {
    const place = graph.place(flow.spawn);
    return place
      ? [
          {
            id: flow.id,
            walk: place.walk,
            x: place.x,
            y: place.y,
            hdg: place.hdg,
            perHour: flow.per_hour,
            selected: selection.has(flow.id),
            problem: wrong.has(flow.id),
          },
        ]
      : [];
  });
}

/** Ids of all whose start lies in an area. */
export const inFrame = (ones: readonly { id: string; x: number; y: number }[], area: Area): string[] =>
  ones.filter(({ x, y }) => area(x, y)).map((one) => one.id);

/** Who is under the pointer: on the body, or within reach of the middle. */
export function nearestOne<T extends { x: number; y: number; length?: number }>(
  ones: readonly T[],
  x: number,
  y: number,
  reach: number,
): T | null {
  let best: T | null = null;
  let least = Infinity;
  for (const one of ones) {
    const away = Math.hypot(one.x - x, one.y - y);
    if (away <= Math.max(reach, (one.length ?? 0) / 2) && away < least) [best, least] = [one, away];
  }
  return best;
}

/** What to show of the map so that a problem is seen; null if it has no place. */
export function boundsOfProblem(problem: Problem, graph: Graph, document: ScenarioDocument): Bounds | null {
  const one = ofProblem(problem, document);
  const nodes = [...problem.nodes, ...(one ? [one.spawn] : [])];
  const boxes = nodes.flatMap((id): Bounds[] => {
    const place = graph.place(id);
    return place ? [[place.x - 25, place.y - 25, place.x + 25, place.y + 25]] : [];
  });
  if (boxes.length === 0) return segmentsBounds(graph, problem.segments);
  return boxes.reduce(join);
}

export function segmentsBounds(graph: Graph, ids: readonly string[]): Bounds | null {
  const all = segmentBounds(graph.columns);
  const boxes = ids.flatMap((id) => {
    const row = graph.segmentRow.get(id);
    const bounds = row === undefined ? undefined : all[row];
    return bounds && Number.isFinite(bounds[0]) ? [bounds] : [];
  });
  return boxes.length > 0 ? boxes.reduce(join) : null;
}

export const join = (a: Bounds, b: Bounds): Bounds => [
  Math.min(a[0], b[0]),
  Math.min(a[1], b[1]),
  Math.max(a[2], b[2]),
  Math.max(a[3], b[3]),
];

/** The step to begin with when a scenario is opened. */
export function firstStep(document: ScenarioDocument): Step {
  if (document.roi.length === 0) return "region";
  return "actors";
}

/** A rectangle around places, which must be some. */
export function boundsOfPlaces(places: readonly Place[]): Bounds {
  return places.map(({ x, y }): Bounds => [x, y, x, y]).reduce(join);
}

/** More placed road users than these are traffic. */
export const MOST_ACTORS = 20;

/** Whether a document is a story of some road users, without traffic around them. */
export const isScene = ({ actors, flows, demand, transit, sumo }: ScenarioDocument): boolean =>
  actors.length > 0 &&
  actors.length <= MOST_ACTORS &&
  flows.length === 0 &&
  transit.lines.length === 0 &&
  !bringsTraffic(demand) &&
  !sumo;
