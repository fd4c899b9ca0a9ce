import { t } from "@lingui/core/macro";

import { address, api, ApiError, call } from "./client";
import type { ConversionReport, Job } from "./types";

const PAUSE = 300;

export const reportUrl = (name: string): string =>
  address("/api/maps/{name}/report", { params: { path: { name } } });
export const conversionReport = (name: string): Promise<ConversionReport> =>
  call("get", "/api/maps/{name}/report", { params: { path: { name } } });

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
