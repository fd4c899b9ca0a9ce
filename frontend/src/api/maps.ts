import type { ConversionReport } from "../catalogue/conversion";
import { api, ask, send } from "./client";
import type { Job } from "./types";

const PAUSE = 300;

export const reportPath = (name: string): string => `/maps/${encodeURIComponent(name)}/report`;
export const conversionReport = (name: string): Promise<ConversionReport> => ask<ConversionReport>(reportPath(name));

/** The maps that come along; the server's job. */
export const addShipped = (): Promise<{ job: string }> => send("POST", "/maps/shipped");

/** Waits for the end of a job, telling how far it is; throws the server's reason if it fails. */
export async function followJob(id: string, onStep: (job: Job) => void): Promise<Job> {
  for (;;) {
    const job = await api.job(id);
    if (job.state === "done") return job;
    if (job.state === "failed") {
      throw new Error((typeof job.error === "string" ? job.error : job.error?.message) ?? "The map could not be read.");
    }
    onStep(job);
    await new Promise((done) => setTimeout(done, PAUSE));
  }
}
