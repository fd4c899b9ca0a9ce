import { call } from "./client";
import type { components } from "./schema";

/** What a figure of a run is; the server's registry says it. */
export type FigureInfo = components["schemas"]["FigureInfo"];

let asked: Promise<FigureInfo[]> | null = null;

/** All figures of a run; asked for once, and again after a failure. */
export function allFigures(): Promise<FigureInfo[]> {
  asked ??= call("get", "/api/figures").catch((error: unknown) => {
    asked = null;
    throw error;
  });
  return asked;
}
