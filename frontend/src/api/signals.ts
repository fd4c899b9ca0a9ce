import { call } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];

/** What a light is to show. */
export type LightProgram = Schemas["LightProgramInfo"];
export type DayPlan = Schemas["DayPlanInfo"];
export type Detector = Schemas["DetectorInfo"];
/** What a light showed in a run: from `times[i]` on `states[shown[i]]`. */
export type ShownStates = Schemas["ShownStates"];

export const signals = {
  ofScenario: (name: string, junction: string) =>
    call("get", "/api/scenarios/{name}/signals/{junction}", { path: { name, junction } }),
  ofRun: (run: string, junction: string) =>
    call("get", "/api/runs/{run}/signals/{junction}", { path: { run, junction } }),
  /** What all lights showed in a finished run. */
  shown: (run: string) => call("get", "/api/runs/{run}/signals", { path: { run } }),
};
