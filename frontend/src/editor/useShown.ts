import { useMemo } from "react";

import type { Assets, ScenarioDocument } from "../api/types";
import type { LoadedGraph } from "../map/loaded";
import type { SceneActor, SceneFlow } from "../map/scene";
import { Starts } from "./placing";
import { insideRows, sceneActors, sceneFlows } from "./scene";

export interface Shown {
  inside: ReadonlySet<number>;
  starts: Starts;
  actors: SceneActor[];
  flows: SceneFlow[];
}

const NO_ACTORS: ReadonlySet<string> = new Set<string>();

/** What the map shows of a document; each part is made anew only when its own cause changes. */
export function useShown(
  { graph, picker }: LoadedGraph,
  document: ScenarioDocument,
  assets: Assets | null,
  selection: readonly string[],
  wrong: ReadonlySet<string>,
): Shown {
  const { roi, actors: placed, flows: sent } = document;
  const inside = useMemo(() => insideRows(graph, roi), [graph, roi]);
  const starts = useMemo(() => {
    const bodies = sceneActors(graph, { actors: placed }, assets, NO_ACTORS, NO_ACTORS);
    const vehicles = bodies.filter(({ category }) => category !== "pedestrian");
    const known = new Map(vehicles.map((body) => [body.id, body]));
    return new Starts(graph, picker, inside, { actors: placed, flows: sent }, known);
  }, [graph, picker, inside, placed, sent, assets]);
  const chosen = useMemo(() => new Set(selection), [selection]);
  const actors = useMemo(
    () => sceneActors(graph, { actors: placed }, assets, chosen, wrong),
    [graph, placed, assets, chosen, wrong],
  );
  const flows = useMemo(
    () => sceneFlows(graph, { flows: sent }, chosen, wrong),
    [graph, sent, chosen, wrong],
  );
  return { inside, starts, actors, flows };
}
