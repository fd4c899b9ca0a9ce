import type { RouteChoice } from "../src/api/demand";
import type { Actor, Assets, Flow, GraphColumns, MapInfo, Problem, ScenarioDocument } from "../src/api/types";
import { Graph, type Place } from "../src/map/graph";

/** How trips choose their routes where a document does not say. */
export const BY_LENGTH: RouteChoice = {
  by: "length",
  iterations: 20,
  gap: 0.01,
  interval: 900,
  spread: 0.03,
  informed: 0,
  period: 60,
  shares: [],
};

export const actor = (id: string, spawn = "1.0.-1.0"): Actor => ({
  id,
  category: "car",
  model: null,
  spawn,
  goal: null,
  via: [],
  speed: null,
  lateral_offset: 0.5,
  longitudinal_offset: 0,
  size: null,
  depart: 0,
  initial_speed: null,
  style: "normal",
  ego: false,
  crosses_anywhere: false,
  ignores_red: false,
  driver: "sumo",
});
export const flow = (id: string, spawn: string): Flow => ({
  id,
  spawn,
  goal: null,
  per_hour: 300,
  begin: 0,
  end: 3600,
  mix: { car: 1 },
  speed: null,
  initial_speed: null,
  profile: null,
});
export const scenario = (actors: Actor[], roi = ["a"], flows: Flow[] = []): ScenarioDocument => ({
  format: "odscen-scenario",
  version: 1,
  name: "s",
  description: "",
  map: { name: "m", sha256: "", spacing: 2 },
  variant: null,
  seed: 0,
  roi,
  environment: { preset: "ClearNoon", parameters: {}, affects_driving: true },
  drivers: {
    saturation_flow: null,
    headway: null,
    gap_acceptance: 0.3,
    lane_change_eagerness: 1,
    sets: [],
    shares: {},
  },
  actors,
  flows,
  demand: {
    clock: 0,
    zones: [],
    profiles: [],
    inputs: [],
    matrices: [],
    counts: [],
    background: [],
    routes: BY_LENGTH,
    parking: { begin: 0, end: 0, stay: 3600, within: 300 },
  },
  transit: { stops: [], lines: [] },
  signals: { control: "fixed", bus_priority: false, junctions: [] },
  measures: [],
  simulation: {
    duration: 60,
    step_length: 0.5,
    action_step: null,
    lateral_resolution: null,
    teleport_after: 300,
    pedestrians: "striping",
    after_story: "auto",
  },
  study: { warm_up: 0, interval: null, detectors: [], sections: [], cordons: [] },
  rules: [],
  criteria: [],
  sumo: null,
  parameters: {},
  formulas: {},
});
export const problem = (where: string, nodes: string[] = []): Problem => ({
  severity: "error",
  code: "x",
  where,
  message: "m",
  nodes,
  segments: ["b"],
});
const walks = {
  lane_keys: ["1.0.3"],
  first_node: [0, 2],
  lane: [0, 0],
  x: [0, 2],
  y: [9, 9],
  hdg: [0, 0],
  width: [2, 2],
  walkable: [1, 1],
  segment: [0, 1],
  source: [],
  target: [],
  kind: [],
};
/** One lane to the east through segments a, b and c with a node in each, and a walkway beside a and b. */
export const columns: GraphColumns = {
  spacing: 2,
  lane_keys: ["1.0.-1"],
  lane_types: ["driving"],
  lane_junctions: [null],
  first_node: [0, 3],
  lane: [0, 0, 0],
  s: [0, 2, 4],
  x: [0, 2, 4],
  y: [0, 0, 0],
  hdg: [0, 0, 0],
  width: [3, 3, 3],
  segment: [0, 1, 2],
  left_lane: [-1, -1, -1],
  right_lane: [-1, -1, -1],
  speed_limit: [13.889, null, null],
  spawnable: [1, 1, 0],
  segments: ["a", "b", "c"].map((id) => ({ id, kind: "road", neighbours: [] })),
  edges: { source: [], target: [], relation: [] },
  walks,
};
export const graph = new Graph(columns);

export const assets: Assets = {
  categories: [
    { category: "car", length: 4.5, width: 1.8, height: 1.5 },
    { category: "pedestrian", length: 0.5, width: 0.5, height: 1.7 },
  ],
  blueprints: [
    {
      id: "vehicle.tesla.model3",
      category: "car",
      special_type: "",
      age: null,
      length: 4.8,
      width: 2.1,
      height: 1.5,
    },
  ],
  weather: [],
  day_profiles: { weekday: [1, 4, 2, 3] },
};

/** A map of the catalogue. */
export const mapInfo = (name: string, junctions: number): MapInfo => ({
  name,
  sha256: "",
  source: "",
  importer: "opendrive",
  opendrive: { version: "1.7", rule: "RHT" },
  report_counts: {},
  lost: {},
  guessed: {},
  network: { converter: "odscen", source: null },
  preview: "",
  outdated: false,
  graph: {
    spacing: 2,
    nodes: 1,
    successor_edges: 0,
    left_edges: 0,
    right_edges: 0,
    segments: 1,
    pedestrian_nodes: 0,
    pedestrian_edges: 0,
  },
  sumo: { net_file: "", edges: 0, lanes: 0, junctions: 0, tl_logics: 0, crossings: 0, walking_areas: 0 },
  statistics: {
    bounds: [0, 0, 1200, 800],
    road_length: 1,
    connecting_road_length: 0,
    driving_lane_length: 33_345,
    roads: 1,
    junctions,
    crosswalks: 1,
    traffic_lights: 0,
    pedestrian_lights: 0,
    stop_signs: 0,
    yield_signs: 0,
    stop_lines: 0,
    speed_limit_min: 13.9,
    speed_limit_max: 13.9,
    rule: "RHT",
  },
});

/** A place of the graph above. */
export function place(id: string): Place {
  const found = graph.place(id);
  if (!found) throw new Error(`the test's own place ${id}`);
  return found;
}
