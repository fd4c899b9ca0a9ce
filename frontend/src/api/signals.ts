import { address, call, form } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];

/** What a light is to show. */
export type LightProgram = Schemas["LightProgramInfo"];
export type DayPlan = Schemas["DayPlanInfo"];
export type Stage = Schemas["StageInfo"];
export type Detector = Schemas["DetectorInfo"];
/** A turn across oncoming traffic. */
export type CrossingTurn = Schemas["TurnInfo"];
/** Two signal groups that meet: the intergreen from the first to the second. */
export type GroupPair = Schemas["GroupPairInfo"];
/** A lane before a light, with its line to the stop line. */
export type DetectorLane = Schemas["DetectorLaneInfo"];
/** What a light showed in a run: from `times[i]` on `states[shown[i]]`. */
export type ShownStates = Schemas["ShownStates"];
/** A scenario whose lights have been timed, and what came of it. */
export type TimedSignals = Schemas["TimedSignalsState"];
export type CorridorWish = Omit<Schemas["CorridorWish"], "version">;

export const signals = {
  ofScenario: (name: string, junction: string) =>
    call("get", "/api/scenarios/{name}/signals/{junction}", { params: { path: { name, junction } } }),
  ofRun: (run: string, junction: string) =>
    call("get", "/api/runs/{run}/signals/{junction}", { params: { path: { run, junction } } }),
  /** What all lights showed in a finished run. */
  shown: (run: string) => call("get", "/api/runs/{run}/signals", { params: { path: { run } } }),
  /** Another cycle: greens in proportion to what they are. */
  setCycle: (name: string, version: number, junction: string, cycle: number, plan: string | null) =>
    call("post", "/api/scenarios/{name}/signals/{junction}/cycle", {
      params: { path: { name, junction } },
      body: { version, cycle, plan },
    }),
  /** Makes the map's program one of the scenario. */
  takeOver: (name: string, version: number, junction: string) =>
    call("post", "/api/scenarios/{name}/signals/{junction}/own", {
      params: { path: { name, junction } },
      body: { version },
    }),
  /** Times lights after the demand; all if no junction is named. */
  webster: (name: string, version: number, junctions: readonly string[], arrows: boolean) =>
    call("post", "/api/scenarios/{name}/signal-times/webster", {
      params: { path: { name } },
      body: { version, junctions: [...junctions], turn_arrows: arrows },
    }),
  corridor: (name: string, version: number, wish: CorridorWish) =>
    call("post", "/api/scenarios/{name}/signal-times/corridor", {
      params: { path: { name } },
      body: { version, ...wish },
    }),
  import: (name: string, version: number, file: File, junction: string | null) =>
    call("post", "/api/scenarios/{name}/signal-times/import", {
      params: { path: { name } },
      body: form({ version: String(version), file, junction }),
    }),
  exportUrl: (name: string) =>
    address("/api/scenarios/{name}/signals.add.xml", { params: { path: { name } } }),
};
