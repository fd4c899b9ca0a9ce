import { address, call } from "./client";
import { followJob } from "./maps";
import type { components } from "./schema";
import type { Job } from "./types";

type Schemas = components["schemas"];

/** What became of each element of the file that a scenario was imported from. */
export type ImportReport = Schemas["ImportInfo"];
export type ImportRow = Schemas["ImportRow"];
/** Files of an export, and what its format cannot say. */
export type ExportNotes = Schemas["ExportInfo"];
export type ExportNote = Schemas["ExportNote"];

/** A foreign format that scenarios or runs are read from or written to. */
export type Format = Schemas["FormatInfo"];

export const exchange = {
  formats: () => call("get", "/api/formats"),
  /** Takes a scenario of a format, with its map and catalogs; gives its name, null if cancelled. */
  bring: async (of: string, files: readonly File[], onStep: (job: Job) => void): Promise<string | null> => {
    const body = new FormData();
    for (const file of files) body.append("files", file);
    const { job } = await call("post", "/api/imports/{of}", { params: { path: { of } }, body });
    const done = await followJob(job, onStep);
    return done?.result ?? null;
  },
  report: (name: string) => call("get", "/api/scenarios/{name}/import", { params: { path: { name } } }),
  planUrl: (name: string) => address("/api/scenarios/{name}/import/plan", { params: { path: { name } } }),
  notes: (name: string, to: string, version: string | null) =>
    call("get", "/api/scenarios/{name}/export/notes", { params: { path: { name }, query: { to, version } } }),
  exportUrl: (name: string, to: string, version: string | null) =>
    address("/api/scenarios/{name}/export", { params: { path: { name }, query: { to, version } } }),
  runUrl: (run: string, to: string, version?: string) =>
    address("/api/runs/{run}/export", { params: { path: { run }, query: { to, version } } }),
};
