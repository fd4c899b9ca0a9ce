import { address, call } from "./client";
import type { components } from "./schema";
import type { ScenarioDocument } from "./types";

type Schemas = components["schemas"];

export type RunInfo = Schemas["RunInfo"];
export type RunProgress = Schemas["RunProgress"];
export type RunState = RunInfo["state"];
/** How to run a scenario. */
export type RunWish = Schemas["NewRun"];
/** Bytes, and road users. */
export type Forecast = Schemas["RunForecast"];
export type RunContent = Schemas["RunContent"];
export type RunFile = Schemas["RunFile"];
/** One count of vehicles and what a run made of it; seconds and metres. */
export type FitRow = Schemas["FitRow"];
export type Summary = Schemas["RunSummary"];
/** Whether the figures of a run can be used. */
export type CriterionInfo = Schemas["CriterionInfo"];
export type Verdict = Schemas["UsabilityInfo"];
/** Something that went wrong on the road. */
export type Incident = Schemas["IncidentInfo"];
/** Who was where: rows `first[i]` to `first[i + 1]` belong to `times[i]`. */
export type ReplayColumns = Schemas["ReplayColumns"];
/** What vehicles did on each lane in each interval. */
export type RunLanes = Schemas["RunLanes"];
/** What became of a vehicle under test. */
export type EgoOutcome = Schemas["EgoOutcome"];
/** Texts of the live view. */
export type LiveMessage = Schemas["LiveMessage"];
export type LiveActor = Schemas["LiveActor"];
export type Action = Schemas["RunControl"]["action"];

/** No replay has more places than this; longer runs have fewer moments. */
const MOST_ROWS = 600_000;

export const runs = {
  /** Those of one scenario, the newest last. */
  list: (scenario: string) => call("get", "/api/runs", { params: { query: { scenario } } }),
  start: (wish: RunWish) => call("post", "/api/runs", { body: wish }),
  forecast: (wish: RunWish) => call("post", "/api/runs/forecast", { body: wish }),
  resume: (run: string) => call("post", "/api/runs/{run}/resume", { params: { path: { run } }, body: {} }),
  fit: (run: string) => call("get", "/api/runs/{run}/fit", { params: { path: { run } } }),
  files: (run: string) => call("get", "/api/runs/{run}/files", { params: { path: { run } } }),
  fileUrl: (run: string, name: string) =>
    address("/api/runs/{run}/files/{name}", { params: { path: { run, name } } }),
  /** The scenario as it was run. */
  scenario: async (run: string): Promise<Pick<ScenarioDocument, "environment">> => {
    const answer = await fetch(runs.fileUrl(run, "scenario.json"));
    if (!answer.ok) throw new Error(answer.statusText);
    return (await answer.json()) as ScenarioDocument;
  },
  info: (run: string) => call("get", "/api/runs/{run}", { params: { path: { run } } }),
  control: (run: string, action: Action, speed?: number | null) =>
    call("post", "/api/runs/{run}/control", {
      params: { path: { run } },
      body: speed === undefined ? { action } : { action, speed },
    }),
  events: (run: string) => call("get", "/api/runs/{run}/events", { params: { path: { run } } }),
  egos: (run: string) => call("get", "/api/runs/{run}/egos", { params: { path: { run } } }),
  curves: (run: string) => call("get", "/api/runs/{run}/curves", { params: { path: { run } } }),
  lanes: (run: string) => call("get", "/api/runs/{run}/lanes", { params: { path: { run } } }),
  content: (run: string) => call("get", "/api/runs/{run}/content", { params: { path: { run } } }),
  replay: (run: string) =>
    call("get", "/api/runs/{run}/trajectories", { params: { path: { run }, query: { most: MOST_ROWS } } }),
  reportUrl: (run: string) => address("/api/runs/{run}/report.html", { params: { path: { run } } }),
  liveUrl: (run: string) =>
    `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api/runs/${encodeURIComponent(run)}/live`,
};
