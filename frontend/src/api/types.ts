import type { Demand, Mix } from "./demand";

/** What the server sends: the names are the server's, lengths in metres, angles in radians. */

export type Category = "car" | "van" | "truck" | "bus" | "motorcycle" | "bicycle" | "pedestrian";
/** The order of the interface. */
export const CATEGORIES: readonly Category[] = [
  "car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian",
];
export type Style = "cautious" | "normal" | "sporty";
export type SignalControl = "fixed" | "actuated";
export type Bounds = [minX: number, minY: number, maxX: number, maxY: number];

export interface MapStatistics {
  bounds: Bounds;
  road_length: number;
  driving_lane_length: number;
  roads: number;
  junctions: number;
  crosswalks: number;
  traffic_lights: number;
  stop_signs: number;
  speed_limit_min: number | null;
  speed_limit_max: number | null;
  rule: string;
}

export interface MapInfo {
  name: string;
  sha256: string;
  statistics: MapStatistics;
  graph: Record<string, number>;
  report_counts: Record<string, number> | null;
  preview: string;
  /** Only of one map asked for by name: where signals stand, and which light steers them. */
  semantics?: { signals: { id: string; x: number; y: number }[] };
  lights?: { id: string; signals: string[][] }[];
}

export interface GraphColumns {
  spacing: number;
  lane_keys: string[];
  lane_types: string[];
  /** The junction that a lane lies in. */
  lane_junctions: (string | null)[];
  first_node: number[];
  lane: number[];
  s: number[];
  x: number[];
  y: number[];
  hdg: number[];
  width: number[];
  /** Metres per second; null where there is none. */
  speed_limit: (number | null)[];
  /** 1 where the simulator can place somebody exactly. */
  spawnable: number[];
  segment: number[];
  segments: { id: string; kind: string; neighbours: number[] }[];
  edges: { source: number[]; target: number[]; relation: number[] };
  walks: WalkColumns;
}

export interface WalkColumns {
  lane_keys: string[];
  first_node: number[];
  lane: number[];
  x: number[];
  y: number[];
  hdg: number[];
  width: number[];
  /** 1 where the simulator can place somebody exactly. */
  walkable: number[];
  segment: number[];
  source: number[];
  target: number[];
  kind: number[];
}

export interface Blueprint {
  id: string;
  category: Category;
  length: number;
  width: number;
  height: number;
}

export interface WeatherPreset {
  name: string;
  kind: string;
  time_of_day: "day" | "sunset" | "night";
  parameters: Record<string, number>;
}

export interface Assets {
  categories: { category: Category; length: number; width: number }[];
  blueprints: Blueprint[];
  weather: WeatherPreset[];
  /** Built-in day profiles: relative shares of equal slices of the day. */
  day_profiles: Record<string, number[]>;
}

export interface Actor {
  id: string;
  category: Category;
  model: string | null;
  spawn: string;
  goal: string | null;
  speed: number | null;
  lateral_offset: number;
  depart: number;
  style: Style;
  ego: boolean;
  crosses_anywhere: boolean;
  ignores_red: boolean;
}

export interface Flow {
  id: string;
  spawn: string;
  goal: string | null;
  per_hour: number;
  begin: number;
  end: number;
  mix: Mix;
  speed: number | null;
  /** Name of a day profile; null is evenly. */
  profile: string | null;
}

export interface ScenarioDocument {
  name: string;
  description: string;
  map: { name: string; sha256: string; spacing: number };
  seed: number;
  roi: string[];
  environment: { preset: string; parameters: Record<string, number>; affects_driving: boolean };
  actors: Actor[];
  flows: Flow[];
  demand: Demand;
  signals: { control: SignalControl; junctions: unknown[] };
  simulation: { duration: number; step_length: number };
}

export interface Problem {
  severity: "error" | "warning";
  code: string;
  where: string;
  message: string;
  nodes: string[];
  segments: string[];
}

export interface ScenarioState {
  /** What the server files it under. */
  name: string;
  version: number;
  document: ScenarioDocument;
  problems: Problem[];
  /** What the last change was, and what undo and redo would change. */
  label?: string | null;
  undo?: string | boolean | null;
  redo?: string | boolean | null;
}

export interface ScenarioEntry {
  name: string;
  title: string | null;
  map: string | null;
  actors: number;
  /** Seconds since 1970. */
  modified: number;
  version: number;
  error: string | null;
}

export interface Job {
  state: "queued" | "running" | "done" | "failed";
  step?: string | null;
  /** Name of what was made. */
  result?: string | null;
  share?: number | null;
  error?: ApiErrorBody | string | null;
}

export interface ApiErrorBody {
  kind: string;
  message: string;
  problems?: (Problem | string)[];
  /** The newest version, where an older one was changed. */
  current?: number | null;
}

/** Which segments are inside, and which may be added or taken out now. */
export interface Roi {
  inside: string[];
  candidates: string[];
  removable: string[];
}

/** One change; `kind` is the name of a function of `odscen.scenario.edits`. */
export interface Edit {
  kind: string;
  [argument: string]: unknown;
}
