import { t } from "@lingui/core/macro";

import type { Bounds, ScenarioDocument } from "../../api/types";
import type { Graph, Place } from "../../map/graph";
import type { SceneLine, ScenePin } from "../../map/scene";
import { join } from "../scene";
import { type Draft, draftOf, type Item, leavesOf, type Rule } from "./draft";

/** Where rules act: signs at places, circles around those that are reached, lines that are driven. */
export interface RuleShapes {
  pins: ScenePin[];
  lines: SceneLine[];
}

type Point = readonly [number, number];

const CIRCLE = 48;

/** What rules look like on the map; that whose form is open as it is there, and stronger. */
export function ruleShapes(
  graph: Graph,
  { rules, actors }: Pick<ScenarioDocument, "rules" | "actors">,
  drafted: Draft | null,
): RuleShapes {
  const starts = new Map(actors.flatMap(({ id, spawn }) => startOf(graph, id, spawn)));
  const others = rules.filter(({ id }) => id !== drafted?.id).map(draftOf);
  const shapes: RuleShapes = { pins: [], lines: [] };
  for (const draft of others) addRule(shapes, graph, draft, starts, drafted === null);
  if (drafted) addRule(shapes, graph, drafted, starts, true);
  return shapes;
}

const startOf = (graph: Graph, id: string, spawn: string): [string, Place][] => {
  const place = graph.place(spawn);
  return place ? [[id, place]] : [];
};

function addRule(
  { pins, lines }: RuleShapes,
  graph: Graph,
  { id, actor, when, then }: Draft,
  starts: ReadonlyMap<string, Place>,
  strong: boolean,
): void {
  const pin = (value: unknown, sign: string, text: string): void => {
    const at = pointOf(graph, value);
    if (at) pins.push({ x: at[0], y: at[1], sign, text, rule: strong ? "strong" : "weak" });
  };
  for (const { kind, values } of leavesOf(when)) {
    const at = pointOf(graph, values.place);
    pin(values.place, "?", t`${id}: when`);
    const within = kind === "reaches" ? values.within : kind === "distance" ? values.below : null;
    if (at && typeof within === "number") lines.push({ points: circle(at, within), strong, arrow: false });
  }
  const start = starts.get(actor);
  let from: Point | null = start ? [start.x, start.y] : null;
  for (const { kind, values } of then.flat()) {
    for (const [value, sign, text] of signsOf(kind, values)) pin(value, sign, `${id}: ${text}`);
    const path = pathOf(kind, values).flatMap((value) => {
      const at = pointOf(graph, value);
      return at ? [at] : [];
    });
    if (path.length === 0) continue;
    lines.push({ points: from ? [from, ...path] : path, strong, arrow: true });
    from = path.at(-1) ?? from;
  }
}

/** Places that an action names besides a path, with the sign and the word for each. */
function signsOf(kind: string, values: Item["values"]): [unknown, string, string][] {
  switch (kind) {
    case "arrive":
      return [
        [values.at, "!", "arrives"],
        [values.when_at, "?", t`when ${String(values.to)} is here`],
      ];
    case "appear":
      return [[Array.isArray(values.at) ? values.at.slice(0, 2) : null, "+", "appears"]];
    case "lane":
      return [[values.to, "!", t`lane to`]];
    case "goal":
      return [[values.to, "■", "goal"]];
    case "walk":
      return [[values.to, "■", t`walks to`]];
    default:
      return [];
  }
}

/** The line that an action moves its road user along, as it is in the document. */
function pathOf(kind: string, values: Item["values"]): readonly unknown[] {
  const list = (value: unknown): readonly unknown[] => (Array.isArray(value) ? value : []);
  switch (kind) {
    case "walk":
      return [...list(values.through), values.to];
    case "path": // where one relative to a road user leads is known in the run only
      return values.relative_to == null ? list(values.points) : [];
    case "replay":
      return list(values.rows).map((row) => list(row).slice(1, 3));
    default:
      return [];
  }
}

function pointOf(graph: Graph, value: unknown): Point | null {
  if (typeof value === "string") {
    const place = graph.place(value);
    return place ? [place.x, place.y] : null;
  }
  const [x, y]: readonly unknown[] = Array.isArray(value) ? value : [];
  return typeof x === "number" && typeof y === "number" ? [x, y] : null;
}

const circle = ([x, y]: Point, radius: number): Point[] =>
  Array.from({ length: CIRCLE + 1 }, (_, k) => {
    const angle = (2 * Math.PI * k) / CIRCLE;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  });

/** A rectangle around all places of a rule, and the start of who acts. */
export function boundsOfRule(graph: Graph, rule: Rule, actors: ScenarioDocument["actors"]): Bounds | null {
  const { pins, lines } = ruleShapes(graph, { rules: [rule], actors }, null);
  const spawn = actors.find(({ id }) => id === rule.actor)?.spawn;
  const start = spawn === undefined ? null : pointOf(graph, spawn);
  const points: Point[] = [
    ...pins.map(({ x, y }): Point => [x, y]),
    ...lines.flatMap((one) => one.points),
    ...(start ? [start] : []),
  ];
  return points.length > 0 ? points.map(([x, y]): Bounds => [x, y, x, y]).reduce(join) : null;
}
