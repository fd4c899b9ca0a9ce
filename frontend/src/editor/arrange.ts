import type { Actor } from "../api/types";
import { nth } from "../lists";
import type { Graph, Place } from "../map/graph";
import type { Moves, Starts } from "./placing";

type Placed = readonly [one: Actor, start: Place];

const placed = (graph: Graph, actors: readonly Actor[]): Placed[] =>
  actors.flatMap((one): Placed[] => {
    const start = graph.place(one.spawn);
    return start ? [[one, start]] : [];
  });

/** Moves to the free starts of their own lanes that are nearest to where they should be; who is there stays. */
function settled(starts: Starts, wishes: readonly (readonly [...Placed, x: number, y: number])[]): Moves {
  const used = new Set<string>();
  return wishes.flatMap(([one, start, x, y]) => {
    const to = starts.onLane(start, x, y, used);
    if (to.id === one.spawn) return [];
    used.add(to.id);
    return [[one.id, to.id] as const];
  });
}

/** All beside the first, each on its own lane. */
export function abreast(graph: Graph, starts: Starts, actors: readonly Actor[]): Moves {
  const [first, ...others] = placed(graph, actors);
  return first
    ? settled(
        starts,
        others.map(([one, start]) => [one, start, first[1].x, first[1].y]),
      )
    : [];
}

/** Even distances along the lane that all share, between the first and the last; null unless three share one. */
export function evenly(graph: Graph, starts: Starts, actors: readonly Actor[]): Moves | null {
  const all = placed(graph, actors).sort(([, a], [, b]) => a.index - b.index);
  const [first, last] = [all[0]?.[1], all.at(-1)?.[1]];
  if (!first || !last || all.length < 3 || all.length < actors.length) return null;
  const [begin, end] = graph.lanePlaces(first);
  if (all.some(([, { walk, index }]) => walk !== first.walk || index < begin || index >= end)) return null;
  const at = first.walk ? graph.columns.walks : graph.columns;
  const wishes = all.slice(1, -1).map(([one, start], k) => {
    const row = Math.round(first.index + ((k + 1) / (all.length - 1)) * (last.index - first.index));
    return [one, start, nth(at.x, row), nth(at.y, row)] as const;
  });
  return settled(starts, wishes);
}

/** Departures one after another, so many seconds apart, from the earliest of them on. */
export function inTurn(actors: readonly Actor[], apart: number): [id: string, depart: number][] {
  const begin = Math.min(...actors.map(({ depart }) => depart));
  return actors.map(({ id }, k) => [id, Number((begin + k * apart).toFixed(3))]);
}
