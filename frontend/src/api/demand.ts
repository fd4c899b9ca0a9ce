import { ask, send } from "./client";
import type { Category, ScenarioState } from "./types";

/** Relative shares; they need not sum to one. */
export type Mix = Partial<Record<Category, number>>;

export interface Zone {
  id: string;
  segments: string[];
}

export interface Profile {
  id: string;
  /** Relative shares of equal slices of the day, from midnight on. */
  shares: number[];
}

interface Window {
  id: string;
  begin: number;
  /** Null is the end of the run. */
  end: number | null;
  profile: string | null;
  mix: Mix;
}

export interface Matrix extends Window {
  trips: [from: string, to: string, number: number][];
}

export interface Counts {
  id: string;
  mix: Mix;
  rows: [place: string, begin: number, end: number, number: number][];
}

/** One of the three amounts is not null. */
export interface Background extends Window {
  fill: number | null;
  per_km: number | null;
  trips: number | null;
}

export interface Demand {
  /** Time of day at the start, seconds after midnight. */
  clock: number;
  zones: Zone[];
  profiles: Profile[];
  matrices: Matrix[];
  counts: Counts[];
  background: Background[];
}

/** What can be read from a table. */
export type TableKind = "od" | "counts" | "profile" | "zones";

export interface DayMade {
  scenario: ScenarioState;
  trips: number;
  peak_trips: number;
  volume: number;
  capacity: number;
}

const at = (name: string): string => `/scenarios/${encodeURIComponent(name)}/demand`;

export const demand = {
  table: (name: string, version: number, kind: TableKind, file: File, part: string | null): Promise<ScenarioState> => {
    const form = new FormData();
    form.append("version", String(version));
    form.append("kind", kind);
    form.append("file", file);
    if (part) form.append("part", part);
    return ask<ScenarioState>(`${at(name)}/table`, { method: "POST", body: form });
  },
  day: (name: string, version: number, day: "weekday" | "weekend", trips: number) =>
    send<DayMade>("POST", `${at(name)}/day`, { version, day, trips }),
};
