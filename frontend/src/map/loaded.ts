import { api } from "../api/client";
import type { PackedDrawing } from "./drawing";
import { Graph } from "./graph";
import { Picker } from "./picking";
import { PlaceNames } from "./placeNames";

export interface LoadedGraph {
  graph: Graph;
  picker: Picker;
}

const drawings = new Map<string, Promise<PackedDrawing>>();
const graphs = new Map<string, Promise<LoadedGraph>>();

function kept<T>(cache: Map<string, Promise<T>>, name: string, load: () => Promise<T>): Promise<T> {
  const found = cache.get(name);
  if (found) return found;
  const made = load();
  cache.set(name, made);
  made.catch(() => cache.delete(name));
  return made;
}

/** Loaded once per map while the page is open. */
export const loadDrawing = (name: string): Promise<PackedDrawing> =>
  kept(drawings, name, () => api.drawing(name));

export const loadGraph = (name: string): Promise<LoadedGraph> =>
  kept(graphs, name, async () => {
    const [columns, names] = await Promise.all([api.graph(name), api.names(name)]);
    const graph = new Graph(columns, new PlaceNames(names));
    return { graph, picker: new Picker(graph) };
  });

/** After a map was removed or replaced. */
export function forgetMaps(): void {
  drawings.clear();
  graphs.clear();
}
