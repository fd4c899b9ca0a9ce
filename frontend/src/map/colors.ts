import type { Category } from "../api/types";
import type { Shown } from "../signals/heads";
import type { MarkKind } from "./scene";

/** Colours that requirements fix, the same in light and dark. */
export const RELATION = ["#000000", "#FF4261", "#00E279"] as const;
export const VEHICLE_NODE = "#24A3F2";
export const PEDESTRIAN_NODE = "#FFD800";
export const ROI_BASE = "#123F8C";
export const ROI_MEMBER = "#2B62BD";
export const ELIGIBLE = "#7CC8FF";
export const GOAL = "#66CCEE";
/** Flows of vehicles; those of pedestrians have the colour of their places. */
export const FLOW = "#0C8599";
export const PROBLEM = "#E03131";
export const MEASURE = "#A5690F";
export const TRANSIT = "#364FC7";

export interface Palette {
  land: string;
  areas: Record<string, string>;
  /** Of areas of a kind that has no colour of its own. */
  otherArea: string;
  marks: Record<string, string>;
  crosswalk: string;
  bar: string;
  stopLine: string;
  building: string;
  parking: string;
  ink: string;
  paper: string;
  /** What is measured on the map. */
  measured: string;
  successor: string;
}

export const LIGHT: Palette = {
  land: "#eef0ea",
  areas: {
    road: "#969ea8",
    shoulder: "#bfc4ca",
    sidewalk: "#e0d8c8",
    bicycle: "#c9a79c",
    parking: "#b3bcc8",
    border: "#d3d9c8",
    median: "#cfdcb9",
    rail: "#b5a892",
  },
  otherArea: "#bfc4ca",
  marks: { white: "#ffffff", yellow: "#f7c325", curb: "#7d848c", bridge: "#4c545c" },
  crosswalk: "#8a7fd055",
  bar: "#ffffff",
  stopLine: "#ffffff",
  building: "#d5cfc6",
  parking: "#ffffff",
  ink: "#22282e",
  paper: "#ffffff",
  measured: "#c2255c",
  successor: RELATION[0],
};

export const DARK: Palette = {
  land: "#1b2024",
  areas: {
    road: "#4a525b",
    shoulder: "#363d44",
    sidewalk: "#57534a",
    bicycle: "#5f4a44",
    parking: "#3d4753",
    border: "#2a332a",
    median: "#2f3b2a",
    rail: "#4b443a",
  },
  otherArea: "#363d44",
  marks: { white: "#dfe3e6", yellow: "#d9a91f", curb: "#7a828a", bridge: "#9aa3ab" },
  crosswalk: "#8a7fd066",
  bar: "#e8ebee",
  stopLine: "#e8ebee",
  building: "#33383c",
  parking: "#cfd4d8",
  ink: "#e9ecef",
  paper: "#12161a",
  measured: "#f06595",
  successor: RELATION[0],
};

export const CATEGORY_COLOR: Record<Category, string> = {
  car: "#1971c2",
  van: "#7048e8",
  truck: "#a3541a",
  bus: "#e8590c",
  motorcycle: "#c2255c",
  bicycle: "#2b8a3e",
  pedestrian: "#f2b600",
};
export const EGO = "#ff2255";
/** Lamps of vehicles that brake, and that are about to turn. */
export const BRAKES = "#ff2a1f";
export const INDICATOR = "#ff9900";
/** Places where no start is possible, and whatever says nothing. */
export const UNUSABLE = "#8b949d";
/** Detectors of the traffic light that is looked at. */
export const DETECTOR = "#2f6fb5";
/** White signs are read on them; distinct from each other and from kinds of road users. */
export const MARK_COLOR: Record<MarkKind, string> = {
  collision: "#c32d3c",
  braking: "#873c1e",
  teleported: "#5a2db4",
  jam: "#960f4b",
  measure: MEASURE,
  rule: "#0f5a87",
  met: "#1e7887",
  unmet: "#d22d00",
};

/** What traffic lights show, the same in light and dark. */
export const SIGNAL_COLOR: Record<Shown, string> = {
  red: "#ff3b30",
  yellow: "#ffc400",
  green: "#22c55e",
  permissive: "#22c55e",
  off: "#8b949d",
};
