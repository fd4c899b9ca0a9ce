import { afterEach, expect, test, vi } from "vitest";

import { inBounds } from "../src/map/areas";
import type { Edit, ScenarioDocument, ScenarioState } from "../src/api/types";
import {
  boundsOfProblem,
  inFrame,
  nearestOne,
  ofProblem,
  sceneActors,
  sceneFlows,
  segmentStyles,
  wrongOnes,
} from "../src/editor/scene";
import { measureShapes, transitPins } from "../src/editor/sceneParts";
import { createEditorStore, selectionAfter } from "../src/editor/store";
import { stubFetch } from "./requests";
import { laneFacts, placeWord } from "../src/editor/placeWords";
import { Starts } from "../src/editor/placing";
import { rowsInSight } from "../src/editor/windowed";
import { Picker } from "../src/map/picking";
import { turnShapes } from "../src/map/laneShapes";
import { Graph } from "../src/map/graph";
import { actor, columns, flow, graph, place, problem, scenario } from "./example";

test("the first segment is dark blue, the rest of the region blue, what can be added light blue", () => {
  const styles = segmentStyles(graph, ["b", "a"], ["c"], true);
  expect([...styles].sort()).toEqual([
    [0, "member"],
    [1, "base"],
    [2, "eligible"],
  ]);
});

test("before the first segment nothing is highlighted, though all may be chosen", () => {
  expect(segmentStyles(graph, [], ["a", "b", "c"], true).size).toBe(0);
});

test("segments of measures are drawn whole, lanes as lanes, and incidents as signs", () => {
  const closure = { id: "m", kind: "closure", begin: 0, end: null, destinations: "leave" } as const;
  const drawn = (...places: string[]) => measureShapes(graph, [{ ...closure, places }], null);
  expect([...drawn("b").segments.keys()]).toEqual([1]);
  expect(drawn("b").rings).toEqual([]);
  const lane = drawn("1.0.-1");
  expect([lane.segments.size, lane.rings.length]).toEqual([0, 1]);
  expect(drawn("nowhere")).toEqual({ segments: new Map(), rings: [], pins: [] });
  const { pins } = measureShapes(
    graph,
    [{ ...closure, kind: "incident", lane: "1.0.-1", s: 2.4, length: 5 }],
    null,
  );
  expect(pins).toEqual([{ x: 2, y: 0, sign: "!", text: "m" }]);
});

test("a turn is drawn by the lanes inside its junction that lead from the one road to the other", () => {
  const crossing = new Graph({
    ...columns,
    lane_keys: ["1.0.-1", "9.0.-1", "2.0.-1", "8.0.-1"],
    lane_types: ["driving", "driving", "driving", "driving"],
    lane_junctions: [null, "j", null, "j"],
    first_node: [0, 1, 2, 3, 4],
    lane: [0, 1, 2, 3],
    s: [0, 0, 0, 0],
    x: [0, 4, 8, 4],
    y: [0, 0, 0, 6],
    hdg: [0, 0, 0, 0],
    width: [3, 3, 3, 3],
    segment: [0, 1, 2, 1],
    left_lane: [-1, -1, -1, -1],
    right_lane: [-1, -1, -1, -1],
    speed_limit: [null, null, null, null],
    spawnable: [1, 1, 1, 1],
    segments: ["r1", "j", "r2"].map((id) => ({ id, kind: id === "j" ? "junction" : "road", neighbours: [] })),
    // The lane at the side leads out of the first road, too, but into no other.
    edges: { source: [0, 1, 0], target: [1, 2, 3], relation: [0, 0, 0] },
  });
  const rings = turnShapes(crossing, "r1>r2");
  expect(rings).toHaveLength(1);
  expect(rings[0]?.slice(0, 2)).toEqual(new Float64Array([3, 1.5]));
  expect(turnShapes(crossing, "r2>r1")).toEqual([]);
});

test("stops are drawn with their names, lines where they begin and end", () => {
  const stop = { id: "s", name: "Market", node: "1.0.-1.1", length: 15, bay: false };
  const line = { id: "7", start: "1.0.-1.0", goal: null };
  const pins = transitPins(graph, { stops: [stop], lines: [line as never] });
  expect(pins).toEqual([
    { x: 2, y: 0, sign: "H", text: "Market" },
    { x: 0, y: 0, sign: "▸", text: "Line 7" },
  ]);
});

test("a new road user or flow is selected; after a removal the others stay selected", () => {
  const [a, b] = [actor("a"), actor("b")];
  expect(selectionAfter(["a"], scenario([a]), scenario([a, b]))).toEqual(["b"]);
  expect(selectionAfter(["a"], scenario([a]), scenario([a], ["a"], [flow("f", "1.0.-1.1")]))).toEqual(["f"]);
  expect(selectionAfter(["a", "b"], scenario([a, b]), scenario([b]))).toEqual(["b"]);
});

test("a road user is drawn to the left of its lane by its offset, and red when it is wrong", () => {
  const document = scenario([actor("a")]);
  const wrong = wrongOnes([problem("actors[0].goal")], document);
  const found = sceneActors(graph, document, null, new Set(["a"]), wrong);
  expect(found[0]).toMatchObject({ x: 0, y: 0.5, offset: 0.5, selected: true, problem: true });
});

test("a flow is drawn at its start, with its volume per hour", () => {
  const document = scenario([], ["a"], [flow("f", "1.0.-1.1")]);
  const wrong = wrongOnes([problem("flows[0].spawn")], document);
  expect(sceneFlows(graph, document, new Set(), wrong)).toMatchObject([
    { id: "f", x: 2, y: 0, perHour: 300, walk: false, problem: true },
  ]);
});

test("a problem leads to its road user or flow and to its place on the map", () => {
  const document = scenario([actor("a"), actor("b", "1.0.-1.2")], ["a"], [flow("f", "1.0.-1.1")]);
  expect(ofProblem(problem("actors[1].spawn"), document)?.id).toBe("b");
  expect(ofProblem(problem("flows[0].spawn"), document)?.id).toBe("f");
  expect(ofProblem(problem("roi"), document)).toBeNull();
  expect(boundsOfProblem(problem("actors[1].spawn"), graph, document)).toEqual([-21, -25, 29, 25]);
  expect(boundsOfProblem(problem("roi"), graph, document)).toEqual([2, 0, 2, 0]);
});

test("a road user is picked within reach or on its body, several in a rectangle", () => {
  const actors = sceneActors(
    graph,
    scenario([actor("a"), actor("b", "1.0.-1.2")]),
    null,
    new Set(),
    new Set(),
  );
  expect(nearestOne(actors, 1.9, 0.5, 0.1)?.id).toBe("a");
  expect(nearestOne(actors, 0, 3, 0.1)).toBeNull();
  expect(inFrame(actors, inBounds([3, -1, 5, 1]))).toEqual(["b"]);
});

const startsOf = (document: ScenarioDocument, ...inside: number[]): Starts =>
  new Starts(graph, new Picker(graph), new Set(inside), document);

test("only free and usable places of the region are offered, of the right kind", () => {
  const starts = startsOf(scenario([actor("a")]), 0, 1, 2);
  expect(starts.near(0, 0, 1, false)?.id).toBe("1.0.-1.1"); // the nearest is taken
  expect(starts.near(4, 0, 1, false)?.id).toBe("1.0.-1.1"); // the nearest cannot be used
  expect(starts.near(0, 0, 1, true)?.id).toBe("ped.1.0.3.0");
  expect(startsOf(scenario([]), 2).near(0, 0, 1, false)).toBeNull();
});

test("a road user that cannot start somewhere comes with the reason", () => {
  expect(startsOf(scenario([]), 2).reasonAt(4, 0, 1, false, "bicycle")).toContain(
    "No bicycle may start on this lane",
  );
  expect(startsOf(scenario([]), 2).reasonAt(0, 9, 1, true, "pedestrian")).toContain("outside the region");
  expect(startsOf(scenario([actor("a")]), 0).reasonAt(0, 0, 1, false, "car")).toContain("occupied");
  expect(startsOf(scenario([]), 0).reasonAt(500, 0, 1, true, "pedestrian")).toContain("sidewalks");
});

test("a start moves along its lane past those who stand there, and not out of the region", () => {
  const at = place("1.0.-1.0");
  expect(startsOf(scenario([actor("a")]), 0, 1).along(at, 1)?.id).toBe("1.0.-1.1");
  expect(startsOf(scenario([actor("a")]), 0).along(at, 1)).toBeNull();
  expect(startsOf(scenario([actor("a"), actor("b", "1.0.-1.1")]), 0, 1).along(at, 1)).toBeNull();
});

test("copies keep their distances, no two on one place", () => {
  const ones = [actor("a"), { ...actor("p", "ped.1.0.3.0"), category: "pedestrian" as const }];
  const to = place("1.0.-1.1");
  expect(startsOf(scenario(ones), 0, 1).shifted(ones, to)).toEqual([
    ["a", "1.0.-1.1"],
    ["p", "ped.1.0.3.1"],
  ]);
});

test("a place is described in words", () => {
  expect(placeWord(graph, "1.0.-1.2")).toBe("Road 1, right lane 1, 4 m");
  expect(placeWord(graph, "ped.1.0.3.1")).toBe("Road 1, left walkway, 2 m");
  expect(laneFacts(graph, "1.0.-1.0")).toBe("Driving lane, 3.0 m wide, limit 50 km/h");
});

test("of a long table only what is in sight is drawn", () => {
  expect(rowsInSight(2000, 30, 3000, 300, 5)).toEqual([95, 115]);
  expect(rowsInSight(4, 30, 0, 300, 5)).toEqual([0, 4]);
  expect(rowsInSight(4, 30, 9000, 300, 5)[1]).toBe(4); // it was longer a moment ago
});

const state = (version: number, ...ids: string[]): ScenarioState => ({
  name: "s",
  version,
  document: scenario(ids.map((id) => actor(id))),
  problems: [],
  label: "",
  undo: null,
  redo: null,
});

function answers(...list: [number, unknown][]): { url: string; body: unknown }[] {
  const asked: { url: string; body: unknown }[] = [];
  stubFetch(({ path: url, body: sent }) => {
    asked.push({ url, body: sent });
    const [status, body] = list.shift() ?? [500, {}];
    return new Response(JSON.stringify(body), { status });
  });
  return asked;
}
afterEach(() => vi.unstubAllGlobals());

const add: Edit = { kind: "add_actor", category: "car", spawn: "1.0.-1.0" };

test("changes go out one at a time, each with the version before it", async () => {
  const asked = answers([200, state(1)], [200, state(2, "a")], [200, state(3, "a", "b")]);
  const store = createEditorStore("s");
  await store.getState().load();
  const { edit } = store.getState();
  await Promise.all([edit(add), edit(add)]);
  expect(asked.slice(1).map((one) => (one.body as { version: number }).version)).toEqual([1, 2]);
  expect(store.getState()).toMatchObject({ saving: "saved", selection: ["b"] });
});

test("a refusal is reported and changes nothing", async () => {
  answers([200, state(1)], [422, { error: { kind: "ScenarioError", message: "the node is taken" } }]);
  const store = createEditorStore("s");
  await store.getState().load();
  expect(await store.getState().edit(add)).toBeNull();
  expect(store.getState()).toMatchObject({
    refusal: { message: "the node is taken", again: null },
    saving: "saved",
  });
  expect(store.getState().scenario?.version).toBe(1);
});

test("what another tab has done is loaded; one's own change can be made again on top", async () => {
  const asked = answers(
    [200, state(1)],
    [409, { error: { kind: "Conflict", message: "newer", current: 5 } }],
    [200, state(5, "x")],
    [200, state(6, "x", "y")],
  );
  const store = createEditorStore("s");
  await store.getState().load();
  await store.getState().edit(add);
  expect(store.getState().scenario?.version).toBe(5);
  await store.getState().refusal?.again?.();
  expect(asked[3]?.body).toEqual({ version: 5, edits: [add] });
  expect(store.getState()).toMatchObject({ refusal: null, selection: ["y"] });
});

test("several edits go out as one", async () => {
  const asked = answers([200, state(1)], [200, state(2)]);
  const store = createEditorStore("s");
  await store.getState().load();
  await store.getState().edit(
    [
      { kind: "grow_roi", segment: "b" },
      { kind: "grow_roi", segment: "c" },
    ],
    "Add 2 segments",
  );
  expect(asked[1]?.body).toEqual({
    version: 1,
    label: "Add 2 segments",
    edits: [
      { kind: "grow_roi", segment: "b" },
      { kind: "grow_roi", segment: "c" },
    ],
  });
});
