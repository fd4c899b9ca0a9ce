import { call } from "./client";
import type { components } from "./schema";

/** What a figure of a run is; the server's registry says it. */
export type FigureInfo = components["schemas"]["FigureInfo"];

/** What a criterion can ask of one road user. */
export type ActorMeasureInfo = components["schemas"]["ActorMeasureInfo"];

/** All measures of single road users. */
export const actorMeasures = (): Promise<ActorMeasureInfo[]> => call("get", "/api/figures/actors");

/** A figure that an installed package offers. */
export type InstalledFigureInfo = components["schemas"]["InstalledFigureInfo"];

/** Figures of installed packages. */
export const installedFigures = (): Promise<InstalledFigureInfo[]> => call("get", "/api/figures/installed");

let asked: Promise<FigureInfo[]> | null = null;

/** All figures of a run; asked for once, and again after a failure. */
export function allFigures(): Promise<FigureInfo[]> {
  asked ??= call("get", "/api/figures").catch((error: unknown) => {
    asked = null;
    throw error;
  });
  return asked;
}
