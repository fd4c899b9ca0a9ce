import { t } from "@lingui/core/macro";
import createClient, { createFinalURL, createQuerySerializer, type MaybeOptionalInit } from "openapi-fetch";
import type {
  HttpMethod,
  PathsWithMethod,
  RequiredKeysOf,
  SuccessResponse,
} from "openapi-typescript-helpers";

import type { components, paths } from "./schema";
import type { Converter, Edit } from "./types";

type ErrorInfo = components["schemas"]["ErrorInfo"];

/** The server's refusal, in its own words. */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    readonly body: ErrorInfo,
  ) {
    super(body.message);
  }
}

const withoutAnswer = (status: number, kind: string, message: string): ApiError =>
  new ApiError(status, { kind, message, problems: [], current: null });

/** A file of a run may lie in a folder: its slashes stay; no other name has any. */
const fillPath = (path: string, names: Record<string, unknown>): string =>
  path.replace(/\{(\w+)\}/g, (_, name: string) =>
    String(names[name]).split("/").map(encodeURIComponent).join("/"),
  );

const client = createClient<paths>({
  baseUrl: location.origin,
  fetch: (request) => fetch(request),
  pathSerializer: fillPath,
});

client.use({
  async onResponse({ response }) {
    // The server was started anew and has another token: its own page says what to do.
    if (response.status === 401) location.reload();
    if (response.ok) return;
    let body: { error?: ErrorInfo } = {};
    try {
      body = (await response.json()) as typeof body;
    } catch {
      // Not one of our answers: say what we know.
    }
    const { status, statusText } = response;
    if (body.error) throw new ApiError(status, body.error);
    throw withoutAnswer(status, "http", t`The server answered ${status} ${statusText}.`);
  },
  onError: () => withoutAnswer(0, "offline", t`The server cannot be reached. Is it still running?`),
});

/** Longest body that is sent even when the page is left meanwhile, characters. */
const MOST_KEPT = 16_000;

type Init<M extends HttpMethod, P extends keyof paths> = MaybeOptionalInit<paths[P], M & keyof paths[P]>;
type InitArgument<I> = RequiredKeysOf<I> extends never ? [init?: I] : [init: I];
/** What a path answers if all is well; nothing if it answers without a body. */
export type Answer<M extends HttpMethod, P extends keyof paths> = paths[P][M & keyof paths[P]] extends {
  responses: infer R extends Record<string | number, object>;
}
  ? SuccessResponse<R>
  : never;

/** Asks the server; arguments and answer are those of its schema. Throws {@link ApiError}. */
export async function call<M extends HttpMethod, P extends PathsWithMethod<paths, M>>(
  method: M,
  path: P,
  ...[init]: InitArgument<Init<M, P>>
): Promise<Answer<M, P>> {
  const body: unknown = init?.body;
  const text = body === undefined || body instanceof FormData ? null : JSON.stringify(body);
  // Survives the page that has sent it; browsers take no more than 64 kB of these.
  const keepalive = text !== null && text.length < MOST_KEPT;
  const { data } = await client.request(method, path, { ...init, keepalive } as never);
  return data as Answer<M, P>;
}

/** Address of a path of the server, with its arguments. */
export const address = <P extends PathsWithMethod<paths, "get">>(
  path: P,
  ...[init]: InitArgument<Init<"get", P>>
): string =>
  createFinalURL(path, {
    baseUrl: "",
    params: { ...init?.params },
    querySerializer: createQuerySerializer(),
    pathSerializer: fillPath,
  });

/** Fields of a form; what is null is left out. */
export function form(fields: Record<string, string | File | null>): FormData {
  const made = new FormData();
  for (const [name, value] of Object.entries(fields)) if (value !== null) made.append(name, value);
  return made;
}

export const api = {
  maps: () => call("get", "/api/maps"),
  map: (name: string) => call("get", "/api/maps/{name}", { params: { path: { name } } }),
  drawing: (name: string) => call("get", "/api/maps/{name}/drawing", { params: { path: { name } } }),
  graph: (name: string) => call("get", "/api/maps/{name}/graph", { params: { path: { name } } }),
  names: (name: string) => call("get", "/api/maps/{name}/names", { params: { path: { name } } }),
  heights: (name: string) => call("get", "/api/maps/{name}/heights", { params: { path: { name } } }),
  addMap: (file: File, converter: Converter) =>
    call("post", "/api/maps", { body: form({ file, converter }) }),
  job: (job: string) => call("get", "/api/jobs/{job}", { params: { path: { job } } }),
  cancelJob: (job: string) => call("delete", "/api/jobs/{job}", { params: { path: { job } } }),
  assets: () => call("get", "/api/assets"),
  scenarios: () => call("get", "/api/scenarios"),
  newScenario: (map: string, name?: string) =>
    call("post", "/api/scenarios", { body: name ? { map, name } : { map } }),
  scenario: (name: string) => call("get", "/api/scenarios/{name}", { params: { path: { name } } }),
  problems: (name: string) => call("get", "/api/scenarios/{name}/problems", { params: { path: { name } } }),
  rename: (name: string, to: string) =>
    call("put", "/api/scenarios/{name}/name", { params: { path: { name } }, body: { name: to } }),
  copyScenario: (name: string, to: string) =>
    call("post", "/api/scenarios/{name}/copy", { params: { path: { name } }, body: { name: to } }),
  /** All of them or none, and one step for undo; the answer is what has changed. */
  edit: (name: string, version: number, edits: readonly Edit[], label?: string) =>
    call("post", "/api/scenarios/{name}/edits", {
      params: { path: { name }, query: { changes: true } },
      body: label ? { version, edits: [...edits], label } : { version, edits: [...edits] },
    }),
  undo: (name: string, version: number) =>
    call("post", "/api/scenarios/{name}/undo", {
      params: { path: { name }, query: { changes: true } },
      body: { version },
    }),
  redo: (name: string, version: number) =>
    call("post", "/api/scenarios/{name}/redo", {
      params: { path: { name }, query: { changes: true } },
      body: { version },
    }),
  goals: (name: string, spawn: string) =>
    call("get", "/api/scenarios/{name}/goals", { params: { path: { name }, query: { spawn } } }),
  path: (name: string, spawn: string, goal: string) =>
    call("get", "/api/scenarios/{name}/path", { params: { path: { name }, query: { spawn, goal } } }),
  /** Where road users are planned to be before any run. */
  plan: (name: string) => call("get", "/api/scenarios/{name}/plan", { params: { path: { name } } }),
  roi: (name: string) => call("get", "/api/scenarios/{name}/roi", { params: { path: { name } } }),
  downloadUrl: (name: string, form: "json" | "graphml") =>
    address("/api/scenarios/{name}/download", { params: { path: { name }, query: { form } } }),
  uploadScenario: (file: File) => call("post", "/api/scenarios/upload", { body: form({ file }) }),
};
