import { create } from "zustand";

/** What of a map is drawn, besides its roads and what a scenario or run has on them. */
export interface MapLayers {
  grid: boolean;
  /** Names of segments: roads and junctions. */
  names: boolean;
  /** Nodes of the lane graph and of the walks, and their edges ahead, when near. */
  nodes: boolean;
  /** Edges of the lane graph to the lanes beside, too: they cross each other between each pair of lanes. */
  changes: boolean;
  /** Signs and traffic lights of the map. */
  signs: boolean;
  buildings: boolean;
  /** The picture that lies under the map, if it has one. */
  picture: boolean;
  overview: boolean;
}

export const FIRST_LAYERS: MapLayers = {
  grid: false,
  names: false,
  nodes: true,
  changes: false,
  signs: true,
  buildings: true,
  picture: true,
  overview: true,
};
const KEY = "odscen.layers";

/** What this browser remembers; what is not known any more is as at first. */
export function readLayers(kept: string | null): MapLayers {
  let found: Partial<Record<keyof MapLayers, unknown>>;
  try {
    found = (JSON.parse(kept ?? "{}") ?? {}) as typeof found;
  } catch {
    found = {};
  }
  const names = Object.keys(FIRST_LAYERS) as (keyof MapLayers)[];
  const one = (name: keyof MapLayers): boolean => {
    const value = found[name];
    return typeof value === "boolean" ? value : FIRST_LAYERS[name];
  };
  return Object.fromEntries(names.map((name) => [name, one(name)])) as unknown as MapLayers;
}

function remembered(): string | null {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

export const useMapLayers = create<MapLayers>(() => readLayers(remembered()));

/** Shows or hides a layer on all maps, and remembers it where the browser lets. */
export function showLayer(name: keyof MapLayers, shown: boolean): void {
  useMapLayers.setState({ [name]: shown });
  try {
    localStorage.setItem(KEY, JSON.stringify(useMapLayers.getState()));
  } catch {
    // It holds until the page is closed.
  }
}
