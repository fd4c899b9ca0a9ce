import { t } from "@lingui/core/macro";

import { address, api, ApiError, call, form } from "./client";
import type { components } from "./schema";
import type { ConversionReport, Job } from "./types";

export type MapEdit = components["schemas"]["MapEdits"]["edits"][number];
export type PlaceInfo = components["schemas"]["PlaceInfo"];

const PAUSE = 300;

export const reportUrl = (name: string): string =>
  address("/api/maps/{name}/report", { params: { path: { name } } });
export const conversionReport = (name: string): Promise<ConversionReport> =>
  call("get", "/api/maps/{name}/report", { params: { path: { name } } });

/** Edits that mend a map, and what became of each. */
export const mapEdits = (name: string) =>
  call("get", "/api/maps/{name}/edits", { params: { path: { name } } });

/** Mends a map by edits, in place of those that it has; the server's job. `out` gets them. */
export const mendMap = (name: string, edits: MapEdit[], out: string) =>
  call("post", "/api/maps/{name}/edits", { params: { path: { name } }, body: { edits, out } });

/** Imports a newer file of the same place with the edits of a map; the server's job. */
export const renewMap = (name: string, file: File, out: string) =>
  call("post", "/api/maps/{name}/file", { params: { path: { name } }, body: form({ file, out }) });

/** What an edit would do to a map as it is: its row, and outlines of what changes. */
export const tryEdit = (name: string, edit: MapEdit) =>
  call("post", "/api/maps/{name}/edits/trial", { params: { path: { name } }, body: { edit } });

/** What is at a place of a map, metres. */
export const placeAt = (name: string, x: number, y: number): Promise<PlaceInfo> =>
  call("get", "/api/maps/{name}/place", { params: { path: { name }, query: { x, y } } });

type Background = components["schemas"]["BackgroundInfo"];

/** The picture under a map, if it has one. */
export const background = (name: string): Promise<Background | null> =>
  call("get", "/api/maps/{name}/background", { params: { path: { name } } });
export const backgroundPicture = (name: string): string =>
  address("/api/maps/{name}/background/picture", { params: { path: { name } } });

/** Lays a picture under a map: by a world file, the tags of a GeoTIFF, or points. */
export const setBackground = (
  name: string,
  given: { file: File; world: File | null; crs: string | null; points: string | null },
): Promise<Background> =>
  call("post", "/api/maps/{name}/background", { params: { path: { name } }, body: form(given) });
export const removeBackground = (name: string) =>
  call("delete", "/api/maps/{name}/background", { params: { path: { name } } });

/** Formats that maps can have. */
export const mapImporters = () => call("get", "/api/map-importers");

/** The maps that come along; the server's job. */
export const addShipped = () => call("post", "/api/maps/shipped");

/**
 * Waits for the end of a job, telling how far it is; throws the server's reason if it fails, and gives
 * null if it was cancelled.
 */
export async function followJob(id: string, onStep: (job: Job) => void): Promise<Job | null> {
  for (;;) {
    const job = await api.job(id);
    if (job.state === "done") return job;
    if (job.state === "cancelled") return null;
    if (job.state === "failed") throw failureOf(job);
    onStep(job);
    await new Promise((done) => setTimeout(done, PAUSE));
  }
}

function failureOf({ error }: Job): Error {
  if (!error) return new Error(t`The work has failed.`);
  return error.kind === "ConflictError" ? new ApiError(409, error) : new Error(error.message);
}
