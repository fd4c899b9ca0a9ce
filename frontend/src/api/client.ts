import type {
  ApiErrorBody, Assets, Edit, GraphColumns, Job, MapInfo, Roi, ScenarioEntry, ScenarioState,
} from "./types";
import type { PackedDrawing } from "../map/drawing";

/** The server's refusal, in its own words. */
export class ApiError extends Error {
  constructor(readonly status: number, readonly body: ApiErrorBody) {
    super(body.message);
  }
}

const BASE = "/api";
const enc = encodeURIComponent;

async function refusal(response: Response): Promise<ApiError> {
  try {
    const body = (await response.json()) as { error?: ApiErrorBody };
    if (body.error) return new ApiError(response.status, body.error);
  } catch {
    // Not one of our answers: say what we know.
  }
  const message = `The server answered ${response.status} ${response.statusText}.`;
  return new ApiError(response.status, { kind: "http", message });
}

export async function ask<T>(path: string, init?: RequestInit): Promise<T> {
  let response: Response;
  try {
    response = await fetch(BASE + path, init);
  } catch {
    throw new ApiError(0, { kind: "offline", message: "The server cannot be reached. Is it still running?" });
  }
  if (!response.ok) throw await refusal(response);
  if (response.status === 204) return undefined as T;
  return (await response.json()) as T;
}

export const send = <T>(method: string, path: string, body?: unknown): Promise<T> =>
  ask<T>(path, {
    method,
    headers: body === undefined ? {} : { "Content-Type": "application/json" },
    body: body === undefined ? null : JSON.stringify(body),
  });

function upload<T>(path: string, file: File): Promise<T> {
  const form = new FormData();
  form.append("file", file);
  return ask<T>(path, { method: "POST", body: form });
}

export const api = {
  maps: () => ask<MapInfo[]>("/maps"),
  map: (name: string) => ask<MapInfo>(`/maps/${enc(name)}`),
  drawing: (name: string) => ask<PackedDrawing>(`/maps/${enc(name)}/drawing`),
  graph: (name: string) => ask<GraphColumns>(`/maps/${enc(name)}/graph`),
  addMap: (file: File) => upload<{ job: string }>("/maps", file),
  removeMap: (name: string) => send<undefined>("DELETE", `/maps/${enc(name)}`),
  job: (id: string) => ask<Job>(`/jobs/${enc(id)}`),
  assets: () => ask<Assets>("/assets"),
  scenarios: () => ask<ScenarioEntry[]>("/scenarios"),
  newScenario: (map: string, name?: string) =>
    send<ScenarioState>("POST", "/scenarios", name ? { map, name } : { map }),
  scenario: (name: string) => ask<ScenarioState>(`/scenarios/${enc(name)}`),
  removeScenario: (name: string) => send<undefined>("DELETE", `/scenarios/${enc(name)}`),
  rename: (name: string, to: string) =>
    send<ScenarioState | undefined>("PUT", `/scenarios/${enc(name)}/name`, { name: to }),
  copyScenario: (name: string, to: string) =>
    send<ScenarioState>("POST", `/scenarios/${enc(name)}/copy`, { name: to }),
  /** All of them or none, and one step for undo. */
  edit: (name: string, version: number, edits: readonly Edit[], label?: string) =>
    send<ScenarioState>("POST", `/scenarios/${enc(name)}/edits`, label ? { version, edits, label } : { version, edits }),
  undo: (name: string, version: number) =>
    send<ScenarioState>("POST", `/scenarios/${enc(name)}/undo`, { version }),
  redo: (name: string, version: number) =>
    send<ScenarioState>("POST", `/scenarios/${enc(name)}/redo`, { version }),
  goals: (name: string, spawn: string) =>
    ask<{ goals: string[] }>(`/scenarios/${enc(name)}/goals?spawn=${enc(spawn)}`),
  path: (name: string, spawn: string, goal: string) =>
    ask<{ nodes: string[]; points: [number, number][] }>(
      `/scenarios/${enc(name)}/path?spawn=${enc(spawn)}&goal=${enc(goal)}`),
  roi: (name: string) =>
    ask<Roi>(`/scenarios/${enc(name)}/roi`),
  downloadUrl: (name: string, form: "json" | "graphml") =>
    `${BASE}/scenarios/${enc(name)}/download?form=${form}`,
  uploadScenario: (file: File) => upload<ScenarioState>("/scenarios/upload", file),
};
