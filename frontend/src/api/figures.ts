import { ask } from "./client";

/** What a figure of a run is; the server's registry says it. */
export interface FigureInfo {
  name: string;
  /** Where the summary has it; empty is at its top. */
  part: "" | "actors" | "figures";
  unit: string;
  label: string;
  definition: string;
  source: string;
  better: "lower" | "higher" | "neither";
  on_page: boolean;
  /** How it is written: times `factor`, in `unit`; `clock` as minutes and seconds. */
  display: { unit: string; factor: number; digits: number; clock: boolean };
}

let asked: Promise<FigureInfo[]> | null = null;

/** All figures of a run; asked for once, and again after a failure. */
export function allFigures(): Promise<FigureInfo[]> {
  asked ??= ask<FigureInfo[]>("/figures").catch((error: unknown) => {
    asked = null;
    throw error;
  });
  return asked;
}
