import { t } from "@lingui/core/macro";

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

type Method = "get" | "post" | "put" | "delete";
/** Paths that have a method. */
type Route<M extends Method> = {
  [P in keyof paths]: paths[P][M] extends { responses: object } ? P : never;
}[keyof paths];
type Answers<M extends Method, P extends keyof paths> = paths[P][M] extends { responses: infer R }
  ? R
  : never;
type Good<R> = R[keyof R & (200 | 201 | 202)];
/** What a path answers if all is well; nothing if it answers without a body. */
export type Answer<M extends Method, P extends keyof paths> =
  Good<Answers<M, P>> extends { content: { "application/json": infer A } } ? A : undefined;
type Arguments<M extends Method, P extends keyof paths> = paths[P][M] extends { parameters: infer A }
  ? A
  : never;
type InPath<A> = A extends { path: infer N } ? { path: N } : { path?: undefined };
type InQuery<A> = A extends { query: infer Q }
  ? { query: Q }
  : A extends { query?: infer Q }
    ? { query?: Q | undefined }
    : never;
type Bodies<M extends Method, P extends keyof paths> = paths[P][M] extends {
  requestBody: { content: infer C };
}
  ? C
  : never;
type WithBody<C> = [C] extends [never]
  ? { body?: undefined }
  : C extends { "application/json": infer B }
    ? { body: B }
    : { body: FormData };
type Wish<M extends Method, P extends keyof paths> = InPath<Arguments<M, P>> &
  InQuery<Arguments<M, P>> &
  WithBody<Bodies<M, P>>;
/** What need not be given may be left out altogether. */
type Given<W> = object extends W ? [wish?: W] : [wish: W];

interface AnyWish {
  path?: object | undefined;
  query?: object | undefined;
  body?: unknown;
}

/** Address of a path of the server, with its arguments. */
export function address<P extends Route<"get">>(path: P, ...[wish]: Given<Wish<"get", P>>): string {
  return filled(path, wish as AnyWish | undefined);
}

function filled(path: string, { path: names, query }: AnyWish = {}): string {
  const values = new Map<string, unknown>(Object.entries(names ?? {}));
  // A file of a run may lie in a folder; everything else has no slash.
  const encoded = (value: string): string => value.split("/").map(encodeURIComponent).join("/");
  const place = path.replace(/\{(\w+)\}/g, (_, name: string) => encoded(String(values.get(name))));
  const asked = Object.entries(query ?? {}).filter(([, value]) => value !== undefined && value !== null);
  const text = new URLSearchParams(asked.map(([name, value]) => [name, String(value)])).toString();
  return text ? `${place}?${text}` : place;
}

async function refusal(response: Response): Promise<ApiError> {
  try {
    const body = (await response.json()) as { error?: ErrorInfo };
    if (body.error) return new ApiError(response.status, body.error);
  } catch {
    // Not one of our answers: say what we know.
  }
  return unanswered(
    response.status,
    "http",
    t`The server answered ${response.status} ${response.statusText}.`,
  );
}

const unanswered = (status: number, kind: string, message: string): ApiError =>
  new ApiError(status, { kind, message, problems: [], current: null });

/** Longest body that is sent even when the page is left meanwhile, characters. */
const MOST_KEPT = 16_000;

/** Asks the server; arguments and answer are those of its schema. Throws {@link ApiError}. */
export async function call<M extends Method, P extends Route<M>>(
  method: M,
  path: P,
  ...[wish]: Given<Wish<M, P>>
): Promise<Answer<M, P>> {
  const given = wish as AnyWish | undefined;
  const body = given?.body;
  const json = body !== undefined && !(body instanceof FormData);
  const text = json ? JSON.stringify(body) : null;
  let response: Response;
  try {
    response = await fetch(filled(path, given), {
      method: method.toUpperCase(),
      headers: json ? { "Content-Type": "application/json" } : {},
      // Survives the page that has sent it; browsers take no more than 64 kB of these.
      ...(text !== null && text.length < MOST_KEPT && { keepalive: true }),
      body: text ?? (body as FormData | undefined) ?? null,
    });
  } catch {
    throw unanswered(0, "offline", t`The server cannot be reached. Is it still running?`);
  }
  // The server was started anew and has another token: its own page says what to do.
  if (response.status === 401) location.reload();
  if (!response.ok) throw await refusal(response);
  if (response.status === 204) return undefined as Answer<M, P>;
  return (await response.json()) as Answer<M, P>;
}

/** Fields of a form; what is null is left out. */
export function form(fields: Record<string, string | File | null>): FormData {
  const made = new FormData();
  for (const [name, value] of Object.entries(fields)) if (value !== null) made.append(name, value);
  return made;
}

export const api = {
  maps: () => call("get", "/api/maps"),
  map: (name: string) => call("get", "/api/maps/{name}", { path: { name } }),
  drawing: (name: string) => call("get", "/api/maps/{name}/drawing", { path: { name } }),
  graph: (name: string) => call("get", "/api/maps/{name}/graph", { path: { name } }),
  addMap: (file: File, converter: Converter) =>
    call("post", "/api/maps", { body: form({ file, converter }) }),
  job: (job: string) => call("get", "/api/jobs/{job}", { path: { job } }),
  cancelJob: (job: string) => call("delete", "/api/jobs/{job}", { path: { job } }),
  assets: () => call("get", "/api/assets"),
  scenarios: () => call("get", "/api/scenarios"),
  newScenario: (map: string, name?: string) =>
    call("post", "/api/scenarios", { body: name ? { map, name } : { map } }),
  scenario: (name: string) => call("get", "/api/scenarios/{name}", { path: { name } }),
  problems: (name: string) => call("get", "/api/scenarios/{name}/problems", { path: { name } }),
  rename: (name: string, to: string) =>
    call("put", "/api/scenarios/{name}/name", { path: { name }, body: { name: to } }),
  copyScenario: (name: string, to: string) =>
    call("post", "/api/scenarios/{name}/copy", { path: { name }, body: { name: to } }),
  /** All of them or none, and one step for undo; the answer is what has changed. */
  edit: (name: string, version: number, edits: readonly Edit[], label?: string) =>
    call("post", "/api/scenarios/{name}/edits", {
      path: { name },
      query: { changes: true },
      body: label ? { version, edits: [...edits], label } : { version, edits: [...edits] },
    }),
  undo: (name: string, version: number) =>
    call("post", "/api/scenarios/{name}/undo", {
      path: { name },
      query: { changes: true },
      body: { version },
    }),
  redo: (name: string, version: number) =>
    call("post", "/api/scenarios/{name}/redo", {
      path: { name },
      query: { changes: true },
      body: { version },
    }),
  goals: (name: string, spawn: string) =>
    call("get", "/api/scenarios/{name}/goals", { path: { name }, query: { spawn } }),
  path: (name: string, spawn: string, goal: string) =>
    call("get", "/api/scenarios/{name}/path", { path: { name }, query: { spawn, goal } }),
  /** Where road users are planned to be before any run. */
  plan: (name: string) => call("get", "/api/scenarios/{name}/plan", { path: { name } }),
  roi: (name: string) => call("get", "/api/scenarios/{name}/roi", { path: { name } }),
  downloadUrl: (name: string, form: "json" | "graphml") =>
    address("/api/scenarios/{name}/download", { path: { name }, query: { form } }),
  uploadScenario: (file: File) => call("post", "/api/scenarios/upload", { body: form({ file }) }),
};
