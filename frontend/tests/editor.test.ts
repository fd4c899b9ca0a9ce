import { afterEach, expect, test, vi } from "vitest";

import type { Actor, GraphColumns, Problem, ScenarioDocument, ScenarioState } from "../src/api/types";
import { actorOfProblem, boundsOfProblem, nearestActor, sceneActors, segmentStyles } from "../src/editor/scene";
import { createEditorStore, selectionAfter } from "../src/editor/store";
import { Graph } from "../src/map/graph";

const actor = (id: string, spawn = "1.0.-1.0"): Actor => ({
  id, category: "car", model: null, spawn, goal: null, speed: null, lateral_offset: 0.5, depart: 0,
  style: "normal", ego: false, crosses_anywhere: false, ignores_red: false,
});
const scenario = (actors: Actor[], roi = ["a"]): ScenarioDocument => ({
  name: "s", description: "", map: { name: "m", sha256: "", spacing: 2 }, seed: 0, roi,
  environment: { preset: "ClearNoon", parameters: {}, affects_driving: true }, actors, flows: [],
  simulation: { duration: 60, step_length: 0.5 },
});
const problem = (where: string, nodes: string[] = []): Problem => ({
  severity: "error", code: "x", where, message: "m", nodes, segments: ["b"],
});
const empty = { lane_keys: [], first_node: [0], lane: [], x: [], y: [], hdg: [], segment: [], source: [], target: [], kind: [] };
const columns: GraphColumns = {
  spacing: 2, lane_keys: ["1.0.-1"], lane_types: ["driving"], first_node: [0, 3], lane: [0, 0, 0],
  s: [0, 2, 4], x: [0, 2, 4], y: [0, 0, 0], hdg: [0, 0, 0], width: [3, 3, 3], segment: [0, 1, 2],
  segments: ["a", "b", "c"].map((id) => ({ id, kind: "road", neighbours: [] })),
  edges: { source: [], target: [], relation: [] }, walks: empty,
};
const graph = new Graph(columns);

test("the first piece is dark blue, the rest of the region blue, what can be added light blue", () => {
  const styles = segmentStyles(graph, ["b", "a"], ["c"], true);
  expect([...styles].sort()).toEqual([[0, "member"], [1, "base"], [2, "eligible"]]);
});

test("before the first piece nothing stands out, though all may be chosen", () => {
  expect(segmentStyles(graph, [], ["a", "b", "c"], true).size).toBe(0);
});

test("a new road user is selected; after a removal the others stay selected", () => {
  const [a, b] = [actor("a"), actor("b")];
  expect(selectionAfter(["a"], [a], [a, b])).toEqual(["b"]);
  expect(selectionAfter(["a", "b"], [a, b], [b])).toEqual(["b"]);
});

test("a road user is drawn to the left of its lane by its offset, and red when it is wrong", () => {
  const found = sceneActors(graph, scenario([actor("a")]), null, ["a"], [problem("actors[0].goal")]);
  expect(found[0]).toMatchObject({ x: 0, y: 0.5, selected: true, problem: true });
});

test("a problem leads to its road user and to its place on the map", () => {
  const document = scenario([actor("a"), actor("b", "1.0.-1.2")]);
  expect(actorOfProblem(problem("actors[1].spawn"), document.actors)?.id).toBe("b");
  expect(actorOfProblem(problem("roi"), document.actors)).toBeNull();
  expect(boundsOfProblem(problem("actors[1].spawn"), graph, document)).toEqual([-21, -25, 29, 25]);
  expect(boundsOfProblem(problem("roi"), graph, document)).toEqual([2, 0, 2, 0]);
});

test("a road user is picked within reach or on its body", () => {
  const actors = sceneActors(graph, scenario([actor("a")]), null, [], []);
  expect(nearestActor(actors, 1.9, 0.5, 0.1)?.id).toBe("a");
  expect(nearestActor(actors, 3, 0.5, 0.1)).toBeNull();
});

const state = (version: number, ...ids: string[]): ScenarioState => ({
  name: "s", version, document: scenario(ids.map((id) => actor(id))), problems: [],
});

function answers(...list: [number, unknown][]): { url: string; body: unknown }[] {
  const asked: { url: string; body: unknown }[] = [];
  vi.stubGlobal("fetch", (url: string, init?: RequestInit) => {
    asked.push({ url, body: typeof init?.body === "string" ? JSON.parse(init.body) : undefined });
    const [status, body] = list.shift() ?? [500, {}];
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
  return asked;
}
afterEach(() => vi.unstubAllGlobals());

test("changes go out one at a time, each with the version before it", async () => {
  const asked = answers([200, state(1)], [200, state(2, "a")], [200, state(3, "a", "b")]);
  const store = createEditorStore("s");
  await store.getState().load();
  const { edit } = store.getState();
  await Promise.all([edit({ kind: "add_actor" }), edit({ kind: "add_actor" })]);
  expect(asked.slice(1).map((one) => (one.body as { version: number }).version)).toEqual([1, 2]);
  expect(store.getState()).toMatchObject({ saving: "saved", selection: ["b"] });
});

test("a refusal is told and changes nothing", async () => {
  answers([200, state(1)], [422, { error: { kind: "ScenarioError", message: "the node is taken" } }]);
  const store = createEditorStore("s");
  await store.getState().load();
  expect(await store.getState().edit({ kind: "add_actor" })).toBeNull();
  expect(store.getState()).toMatchObject({ refusal: "the node is taken", saving: "saved" });
  expect(store.getState().scenario?.version).toBe(1);
});

test("what another tab has done is loaded, not overwritten", async () => {
  answers([200, state(1)], [409, { error: { kind: "Conflict", message: "newer" } }], [200, state(5, "x")]);
  const store = createEditorStore("s");
  await store.getState().load();
  await store.getState().edit({ kind: "add_actor" });
  expect(store.getState().scenario?.version).toBe(5);
  expect(store.getState().refusal).toContain("another tab");
});
