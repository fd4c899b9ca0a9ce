import type { Category } from "../api/types";
import type { Place } from "./graph";

export type SegmentStyle = "base" | "member" | "eligible" | "problem" | "measure";

export interface SceneActor {
  id: string;
  category: Category;
  x: number;
  y: number;
  hdg: number;
  length: number;
  width: number;
  ego: boolean;
  /** Metres to the left of the middle of its lane; `x` and `y` have it in them already. */
  offset: number;
  selected: boolean;
  problem: boolean;
}

/** Road users that keep entering at one place. */
export interface SceneFlow {
  id: string;
  walk: boolean;
  x: number;
  y: number;
  hdg: number;
  perHour: number;
  selected: boolean;
  problem: boolean;
}

/** A sign at a point: a stop, an incident, a light that is off. */
export interface ScenePin {
  x: number;
  y: number;
  /** What is written in it. */
  sign: string;
  /** What is written below it. */
  text: string;
  /** Of a rule: whether it is one that is looked at. */
  rule?: "strong" | "weak";
}

/** A line that a rule moves a road user along, or the edge of where one is triggered. */
export interface SceneLine {
  points: readonly (readonly [number, number])[];
  /** Whether it is one that is looked at. */
  strong: boolean;
  arrow: boolean;
}

/** A recorded track under a scenario, and its body at a moment; null while it is not there. */
export interface SceneGhost {
  points: readonly (readonly [number, number])[];
  body: { x: number; y: number; hdg: number; length: number; width: number } | null;
}

/** A detector of the traffic light that is looked at. */
export interface SceneDetector {
  /** Points along it in driving direction, or where people wait. */
  place: readonly (readonly [number, number])[];
  label: string;
  /** Whether it sees buses only. */
  bus: boolean;
  occupied: boolean;
}

/** Lanes in colours that say how they were used: rings of each colour, x and y in turn. */
export interface LaneColors {
  colors: readonly string[];
  rings: readonly (readonly Float64Array[])[];
}

/** Everything of a scenario that is drawn on the map, ready to draw. */
export interface Scene {
  segments: ReadonlyMap<number, SegmentStyle>;
  /** Lanes that measures act on, as rings: x and y in turn. */
  lanes: readonly Float64Array[];
  laneColors?: LaneColors | null;
  pins: readonly ScenePin[];
  lines: readonly SceneLine[];
  /** Tracks of a recording that it was made of, below all else. */
  ghosts?: readonly SceneGhost[];
  detectors: readonly SceneDetector[];
  hoverSegment: number | null;
  /** Which places are shown when near. */
  nodes: { vehicles: boolean; walks: boolean; inside: ReadonlySet<number> | null };
  actors: readonly SceneActor[];
  flows: readonly SceneFlow[];
  goals: readonly Place[];
  chosenGoal: Place | null;
  /** Points of the route to the goal that is chosen. */
  route: readonly (readonly [number, number])[];
  /** Waypoints of that route, in their order. */
  waypoints: readonly Place[];
  hover: Place | null;
  /** What is said beside the place under the pointer. */
  hoverText: string | null;
  hoverCategory: Category | null;
}

export const EMPTY_SCENE: Scene = {
  segments: new Map(),
  lanes: [],
  pins: [],
  lines: [],
  detectors: [],
  hoverSegment: null,
  nodes: { vehicles: true, walks: true, inside: null },
  actors: [],
  flows: [],
  goals: [],
  chosenGoal: null,
  route: [],
  waypoints: [],
  hover: null,
  hoverText: null,
  hoverCategory: null,
};

/** A colour for each road user, by its number among some. */
export interface Tint {
  group: Uint8Array;
  colors: readonly string[];
}

/** Road users at one moment: columns, so that thousands cost little. */
export interface Moving {
  count: number;
  /** Five numbers each: x, y, hdg, length, width. */
  pose: Float64Array;
  category: Uint8Array;
  flags: Uint8Array;
  /** Colours that say something else than the kind. */
  tint?: Tint | null;
  /** Row of the road user to be marked as ego, or -1. */
  ego: number;
  followed: number;
}

/** A place where something happened; `fresh` just now. */
export interface Mark {
  x: number;
  y: number;
  kind: MarkKind;
  fresh: boolean;
}

export type MarkKind = "collision" | "braking" | "teleported" | "jam" | "measure" | "rule" | "met" | "unmet";
