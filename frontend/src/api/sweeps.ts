import { address, call } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];

export type SweepInfo = Schemas["SweepInfo"];
/** What is to be swept, and how. */
export type SweepWish = Schemas["SweepWish"];
export type VaryWish = Schemas["VaryWish"];
/** Number of cases, wall seconds and bytes. */
export type PlannedSweep = Schemas["PlannedSweep"];
/** The table of a sweep and its boundary. */
export type SweepCases = Schemas["SweepCases"];
export type SweepCase = Schemas["SweepCase"];

export const sweeps = {
  /** Those of one scenario, the newest last. */
  list: (scenario: string) => call("get", "/api/sweeps", { params: { query: { scenario } } }),
  /** Runs one case to see what all will take. */
  plan: (wish: SweepWish) => call("post", "/api/sweeps/plan", { body: wish }),
  start: (wish: SweepWish) => call("post", "/api/sweeps", { body: wish }),
  info: (sweep: string) => call("get", "/api/sweeps/{sweep}", { params: { path: { sweep } } }),
  stop: (sweep: string) => call("post", "/api/sweeps/{sweep}/stop", { params: { path: { sweep } } }),
  resume: (sweep: string, processes: number) =>
    call("post", "/api/sweeps/{sweep}/resume", { params: { path: { sweep } }, body: { processes } }),
  remove: (sweep: string) => call("delete", "/api/sweeps/{sweep}", { params: { path: { sweep } } }),
  cases: (sweep: string) => call("get", "/api/sweeps/{sweep}/cases", { params: { path: { sweep } } }),
  /** Saves a case as a scenario. */
  open: (sweep: string, one: string) =>
    call("post", "/api/sweeps/{sweep}/cases/{case}/scenario", {
      params: { path: { sweep, case: one } },
      body: {},
    }),
  fileUrl: (sweep: string, name: string) =>
    address("/api/sweeps/{sweep}/files/{name}", { params: { path: { sweep, name } } }),
};
