import { address, call } from "./client";
import { followJob } from "./maps";
import type { components } from "./schema";
import type { Job } from "./types";

type Schemas = components["schemas"];

/** A recording, in a list. */
export type RecordingRow = Schemas["RecordingRow"];
/** All of a recording but where road users were. */
export type RecordingInfo = Schemas["RecordingInfo"];
export type RecordedScene = Schemas["RecordedScene"];
export type SceneKind = RecordedScene["kind"];
export type MapAgreement = Schemas["MapAgreement"];
/** What others do in a scenario of a recording. */
export type Follow = Schemas["RecordingPart"]["follow"];
/** A track that is shown under a scenario. */
export type Ghost = Schemas["Ghost"];

type Step = (job: Job) => void;
const named = (name: string) => ({ params: { path: { name } } });

export const recordings = {
  list: () => call("get", "/api/recordings"),
  /** Takes the files of a recording; gives its name, null if cancelled. */
  bring: async (files: readonly File[], onStep: Step): Promise<string | null> => {
    const body = new FormData();
    for (const file of files) body.append("files", file);
    const { job } = await call("post", "/api/recordings", { body });
    return (await followJob(job, onStep))?.result ?? null;
  },
  info: (name: string) => call("get", "/api/recordings/{name}", named(name)),
  remove: (name: string) => call("delete", "/api/recordings/{name}", named(name)),
  /** Maps on whose lanes its vehicles are, the best first. */
  maps: (name: string) => call("get", "/api/recordings/{name}/maps", named(name)),
  place: async (name: string, place: Schemas["RecordingPlace"], onStep: Step): Promise<void> => {
    const { job } = await call("post", "/api/recordings/{name}/map", { ...named(name), body: place });
    await followJob(job, onStep);
  },
  /** Looks for its scenes, or waits until they have been found; false if that was cancelled. */
  search: async (name: string, onStep: Step): Promise<boolean> => {
    const { job } = await call("post", "/api/recordings/{name}/search", named(name));
    return (await followJob(job, onStep)) !== null;
  },
  pictureUrl: (name: string) => address("/api/recordings/{name}/picture", named(name)),
  momentsUrl: (name: string, begin: number, end: number, most: number) =>
    address("/api/recordings/{name}/moments", { params: { path: { name }, query: { begin, end, most } } }),
  /** Makes a scenario of a part; gives its name, null if cancelled. */
  scenario: async (name: string, part: Schemas["RecordingPart"]): Promise<string | null> => {
    const { job } = await call("post", "/api/recordings/{name}/scenarios", { ...named(name), body: part });
    return (await followJob(job, () => undefined))?.result ?? null;
  },
  ghosts: (scenario: string) => call("get", "/api/scenarios/{name}/ghosts", named(scenario)),
};
