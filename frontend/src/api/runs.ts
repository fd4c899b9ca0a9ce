import { ask, send } from "./client";
import type { ApiErrorBody, Category } from "./types";

export interface RunInfo {
  run: string;
  state: string;
  /** The scenario's title when it was run. */
  scenario: string;
  map: string | null;
  /** Simulated seconds per second; null is as fast as it can. */
  speed?: number | null;
  progress?: {
    time: number; until: number; running: number; arrived: number; planned: number;
    /** Wall seconds at full speed; null if unknown. */
    time_left?: number | null;
  } | null;
  summary?: Summary | null;
  error?: ApiErrorBody | string | null;
  /** Seconds since 1970; null until its results are written. */
  finished?: number | null;
  /** Whether CARLA shows it too, and its camera can be watched. */
  carla?: boolean;
  /** Of a long run that has not ended: how much of it cannot be lost any more, seconds. */
  slices?: { done: number; length: number; time: number } | null;
}

/** How to run a scenario. */
export interface RunWish {
  scenario: string;
  /** Simulated seconds per second; null is as fast as it can. */
  speed?: number | null;
  carla?: boolean;
  /** Whether places of road users are recorded, and every how many seconds; null is with each step. */
  trajectories?: boolean;
  every?: number | null;
}

/** Bytes, and road users. */
export interface Forecast {
  planned: number;
  running: number;
  disk: number;
  memory: number;
  free: number;
}

export interface SliceDone {
  time: number;
  running: number;
  wall_seconds: number;
  memory_mb: number;
}

export interface RunFile {
  name: string;
  size: number;
}

/** One count of vehicles and what a run made of it; seconds and metres. */
export interface FitRow {
  counts: string;
  place: string;
  begin: number;
  end: number;
  counted: number;
  modelled: number;
  geh: number;
  met: boolean;
  why: string;
  x: number | null;
  y: number | null;
}

export interface Fit {
  rows: FitRow[];
  met: number;
  rmse: number | null;
  contradictions: string[];
}

export type Summary = Record<string, unknown>;

/** Something that went wrong on the road. */
export interface Incident {
  time: number;
  kind: string;
  actor: string;
  partner?: string;
  x?: number;
  y?: number;
}

export interface Curves {
  counts: { time: number[]; running: number[]; arrived: number[]; waiting: number[] };
  /** Metres per second; null where no vehicle was on the road. */
  speeds: { time: number[]; mean: (number | null)[]; low: (number | null)[]; high: (number | null)[] };
  shares: { edges: number[]; share: number[] };
}

/** Who was where: rows `first[i]` to `first[i + 1]` belong to `times[i]`. */
export interface ReplayColumns {
  times: number[];
  first: number[];
  actor: number[];
  x: number[];
  y: number[];
  hdg: number[];
  speed: number[];
  actors: { id: string; category: Category; length: number; width: number; ego: boolean }[];
}

/** No replay has more places than this; longer runs have fewer moments. */
const MOST_ROWS = 600_000;

const at = (run: string): string => `/runs/${encodeURIComponent(run)}`;

export const runs = {
  /** Those of one scenario, the newest last. */
  list: (scenario: string) => ask<RunInfo[]>(`/runs?scenario=${encodeURIComponent(scenario)}`),
  start: (wish: RunWish) => send<{ run: string }>("POST", "/runs", wish),
  forecast: (wish: RunWish) => send<Forecast>("POST", "/runs/forecast", wish),
  goOn: (run: string) => send<{ run: string }>("POST", `${at(run)}/resume`, {}),
  fit: (run: string) => ask<Fit>(`${at(run)}/fit`),
  files: (run: string) => ask<RunFile[]>(`${at(run)}/files`),
  fileUrl: (run: string, name: string) => `/api${at(run)}/files/${name.split("/").map(encodeURIComponent).join("/")}`,
  info: (run: string) => ask<RunInfo>(at(run)),
  control: (run: string, action: string, speed?: number | null) =>
    send<RunInfo>("POST", `${at(run)}/control`, speed === undefined ? { action } : { action, speed }),
  remove: (run: string) => send<undefined>("DELETE", at(run)),
  events: (run: string) => ask<{ events: Incident[]; left_off: number }>(`${at(run)}/events`),
  curves: (run: string) => ask<Curves>(`${at(run)}/curves`),
  content: (run: string) => ask<{ digest: string; counts: number }>(`${at(run)}/content`),
  replay: (run: string) => ask<ReplayColumns>(`${at(run)}/trajectories?most=${MOST_ROWS}`),
  reportUrl: (run: string) => `/api${at(run)}/report.html`,
  liveUrl: (run: string) => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api${at(run)}/live`,
};
