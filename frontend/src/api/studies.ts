import { address, call } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];

export type StudyInfo = Schemas["StudyInfo"];
/** Scenarios, weather and seeds. */
export type StudyWish = Schemas["StudyWish"];
/** One figure of a study. */
export type StudyResults = Schemas["StudyResults"];
export type StudyFigure = Schemas["StudyFigure"];
/** A figure over the runs of a scenario and variant. */
export type FigureGroup = Schemas["FigureGroup"];

export const studies = {
  /** The newest last. */
  list: () => call("get", "/api/studies"),
  start: (wish: StudyWish) => call("post", "/api/studies", { body: wish }),
  info: (study: string) => call("get", "/api/studies/{study}", { params: { path: { study } } }),
  stop: (study: string) => call("post", "/api/studies/{study}/stop", { params: { path: { study } } }),
  /** Runs what is missing; `failed` those again that failed. */
  resume: (study: string, processes: number, failed = false) =>
    call("post", "/api/studies/{study}/resume", { params: { path: { study } }, body: { processes, failed } }),
  remove: (study: string) => call("delete", "/api/studies/{study}", { params: { path: { study } } }),
  results: (study: string, figure: string | null) =>
    call("get", "/api/studies/{study}/results", {
      params: { path: { study }, query: figure === null ? {} : { figure } },
    }),
  fileUrl: (study: string, name: string) =>
    address("/api/studies/{study}/files/{name}", { params: { path: { study, name } } }),
};
