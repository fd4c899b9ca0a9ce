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
  progress?: { time: number; until: number; running: number; arrived: number; planned: number } | null;
  summary?: Summary | null;
  error?: ApiErrorBody | string | null;
  /** Seconds since 1970; null until its results are written. */
  finished?: number | null;
  /** Whether CARLA shows it too, and its camera can be watched. */
  carla?: boolean;
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
  info: (run: string) => ask<RunInfo>(at(run)),
  control: (run: string, action: string, speed?: number | null) =>
    send<RunInfo>("POST", `${at(run)}/control`, speed === undefined ? { action } : { action, speed }),
  remove: (run: string) => send<undefined>("DELETE", at(run)),
  events: (run: string) => ask<{ events: Incident[]; left_off: number }>(`${at(run)}/events`),
  curves: (run: string) => ask<Curves>(`${at(run)}/curves`),
  content: (run: string) => ask<{ digest: string }>(`${at(run)}/content`),
  replay: (run: string) => ask<ReplayColumns>(`${at(run)}/trajectories?most=${MOST_ROWS}`),
  reportUrl: (run: string) => `/api${at(run)}/report.html`,
  liveUrl: (run: string) => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api${at(run)}/live`,
};
