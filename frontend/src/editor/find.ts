import { t } from "@lingui/core/macro";

import type { Actor, Flow } from "../api/types";
import type { Graph } from "../map/graph";
import { CATEGORY_WORD, flowWord } from "../ui/words";
import { isFlow } from "./placing";

/** Something of the map or the scenario that can be gone to. */
export interface Found {
  is: "segment" | "one";
  id: string;
  /** By which it is called; its id if it has no other name. */
  name: string;
  /** What it is, in a word. */
  kind: string;
}

/** More than these are not listed; a longer search finds fewer. */
const MOST = 12;

/**
 * Road users, roads and junctions whose id, name or kind has every word of a search in it: those with just
 * that id first, then those whose id begins with it, in the order of the scenario and of the map.
 */
export function findAll(graph: Graph, ones: readonly (Actor | Flow)[], search: string): Found[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const last = words.at(-1);
  if (last === undefined) return [];
  const ranks: Found[][] = [[], [], []];
  const look = (one: Found): void => {
    const text = `${one.kind} ${one.id} ${one.name}`.toLowerCase();
    if (!words.every((word) => text.includes(word))) return;
    const id = one.id.toLowerCase();
    const bare = one.is === "segment" ? id.slice(1) : id;
    const rank = id === last || bare === last ? 0 : id.startsWith(last) || bare.startsWith(last) ? 1 : 2;
    ranks[rank]?.push(one);
  };
  for (const one of ones) look({ is: "one", id: one.id, name: one.id, kind: kindOf(one) });
  for (const { id, kind } of graph.columns.segments)
    look({
      is: "segment",
      id,
      name: kind === "junction" ? graph.names.junction(id) : graph.names.road(id),
      kind: kind === "junction" ? t`Junction` : t`Road`,
    });
  return ranks.flat().slice(0, MOST);
}

const kindOf = (one: Actor | Flow): string =>
  isFlow(one) ? flowWord("pedestrian" in one.mix) : CATEGORY_WORD()[one.category];
