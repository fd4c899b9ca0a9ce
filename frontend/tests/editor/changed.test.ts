import { afterEach, beforeEach, expect, test, vi } from "vitest";

import type { DocumentChange, Edit, ScenarioState } from "../../src/api/types";
import { patched, reused } from "../../src/editor/documentChanges";
import { foreseen } from "../../src/editor/foreseen";
import { createEditorStore } from "../../src/editor/store";
import { stubFetch } from "../requests";
import { type Draft, draftOf, ruleOf } from "../../src/editor/rules/draft";
import { shownRule } from "../../src/editor/rules/shownRule";
import { Timeline } from "../../src/editor/timeline";
import { actor, flow, scenario } from "../example";

const document = scenario([actor("a"), actor("b"), actor("c")], ["r1"], [flow("f", "1.0.-1.1")]);
const change = (op: DocumentChange["op"], path: string, value: unknown = null): DocumentChange => ({
  op,
  path,
  value,
});

test("changes make the new document, and leave what they are not about as the same objects", () => {
  const made = patched(document, [
    change("remove", "/actors/1"),
    change("replace", "/actors/1/depart", 4),
    change("add", "/actors/2", actor("d")),
    change("replace", "/roi", ["r1", "r2"]),
  ]);
  expect(made.actors.map(({ id, depart }) => [id, depart])).toEqual([
    ["a", 0],
    ["c", 4],
    ["d", 0],
  ]);
  expect(made.roi).toEqual(["r1", "r2"]);
  expect(made.actors[0]).toBe(document.actors[0]);
  expect(made.flows).toBe(document.flows);
  expect(document.actors).toHaveLength(3);
});

test("names with slashes and tildes are read as the standard writes them", () => {
  const made = patched(document, [change("add", "/environment/parameters/a~1b~0c", 1)]);
  expect(made.environment.parameters).toEqual({ "a/b~c": 1 });
  const back = patched(made, [change("remove", "/environment/parameters/a~1b~0c")]);
  expect(back.environment.parameters).toEqual({});
});

test.each(["/actors/3", "/actors/0/goal/deep", "/actors/x"])("nothing is made up at %s", (path) => {
  expect(() => patched(document, [change("replace", path, 1)])).toThrow(path);
});

test("what says the same is the same object", () => {
  expect(reused(document, structuredClone(document))).toBe(document);
  const other = structuredClone(patched(document, [change("replace", "/actors/2/goal", "n")]));
  const made = reused(document, other);
  expect(made).toEqual(other);
  expect(made.actors[0]).toBe(document.actors[0]);
  expect(made.actors[2]).not.toBe(document.actors[2]);
  expect(reused({ a: 1, b: undefined }, { a: 1 } as object)).toEqual({ a: 1 });
  expect(reused([1, 2, 3], [1, 2])).toEqual([1, 2]);
});

test("of lists with one more or one less, all others are the same objects", () => {
  const lead = structuredClone(patched(document, [change("remove", "/actors/0")]));
  const less = reused(document, lead);
  expect(less.actors).toEqual(lead.actors);
  expect(less.actors[0]).toBe(document.actors[1]);
  expect(less.actors[1]).toBe(document.actors[2]);
  const more = structuredClone(patched(document, [change("add", "/actors/1", actor("new"))]));
  const made = reused(document, more);
  expect(made).toEqual(more);
  expect([made.actors[0], ...made.actors.slice(2)]).toEqual(document.actors);
  expect(made.actors[2]).toBe(document.actors[1]);
  expect(reused(document, { ...document, actors: document.actors.toReversed() }).actors).toEqual(
    document.actors.toReversed(),
  );
});

test("new road users and flows are foreseen with the names that the server will give", () => {
  const made = foreseen(document, [
    { kind: "add_actor", category: "car", spawn: "n1" },
    { kind: "add_actor", category: "car", spawn: "n2", ego: true, depart: 3 },
    { kind: "add_flow", spawn: "n3", per_hour: 60, mix: { van: 1 } },
    { kind: "copy_actors", copies: { n4: "a", n5: "car-2" } },
    { kind: "change_flow", flow: "flow-1", per_hour: 70 },
  ]);
  const fresh = { ...actor("car-1", "n1"), lateral_offset: 0 };
  expect(made?.actors.slice(3)).toEqual([
    fresh,
    { ...fresh, id: "car-2", spawn: "n2", ego: true, depart: 3 },
    { ...actor("car-3", "n4") },
    { ...fresh, id: "car-4", spawn: "n5", depart: 3 },
  ]);
  expect(made?.flows[1]).toEqual({ ...flow("flow-1", "n3"), per_hour: 70, mix: { van: 1 } });
  expect(document.actors).toHaveLength(3);
});

test("moves, goals, fields, the ego and removals are foreseen; what only the server knows is not", () => {
  const made = foreseen(document, [
    { kind: "move_actor", actor: "a", spawn: "n1" },
    { kind: "set_goal", actor: "a", goal: "n2" },
    { kind: "change_actor", actor: "b", speed: 9 },
    { kind: "set_ego", actor: "b" },
    { kind: "remove_actors", actors: ["c"] },
    { kind: "remove_flow", flow: "f" },
  ]);
  expect(made?.actors).toEqual([
    { ...actor("a"), spawn: "n1", goal: "n2" },
    { ...actor("b"), speed: 9, ego: true },
  ]);
  expect(made?.flows).toEqual([]);
  const unknown: Edit[] = [
    { kind: "copy_actors", copies: { n: "nobody" } },
    { kind: "shrink_roi", segment: "r1", with_actors: true },
    { kind: "change_flow", flow: "f", id: "z" },
    { kind: "change_actor", actor: "a", category: "van" },
    { kind: "change_actor", actor: "a", id: "z" },
    { kind: "move_actor", actor: "nobody", spawn: "n" },
    { kind: "set_ego", actor: "nobody" },
  ];
  for (const edit of unknown) expect(foreseen(document, [edit])).toBeNull();
});

test("a region that grows or shrinks is foreseen, as far as no road user goes with it", () => {
  const grown = foreseen({ ...document, roi: ["r1"] }, [
    { kind: "grow_roi", segment: "r2" },
    { kind: "extend_roi", segments: ["r2", "r3"] },
    { kind: "shrink_roi", segment: "r1" },
  ]);
  expect(grown?.roi).toEqual(["r2", "r3"]);
  expect(grown?.actors).toBe(document.actors);
});

const closure = (id: string, places: string[]) => ({
  id,
  kind: "closure" as const,
  begin: 0,
  end: null,
  places,
});

test("measures are foreseen: new ones, changed ones, and under another name", () => {
  const made = foreseen(document, [
    { kind: "set_measure", measure: closure("a", ["r1"]) },
    { kind: "set_measure", measure: closure("b", ["r2"]) },
    { kind: "set_measure", measure: closure("a", ["r1", "r3"]) },
    { kind: "set_measure", measure: closure("c", ["r2"]), instead_of: "b" },
  ]);
  expect(made?.measures).toEqual([closure("a", ["r1", "r3"]), closure("c", ["r2"])]);
  const unknown: Edit = { kind: "set_measure", measure: closure("c", ["r2"]), instead_of: "z" };
  expect(foreseen(document, [unknown])).toBeNull();
});

test("a rule is foreseen with what it leaves out, and those that wait for it follow its new name", () => {
  const draft = draftOf(
    shownRule({ id: "first", actor: "a", when: { time: { after: 3 } }, then: [{ brake: { by: 4 } }] }),
  );
  const waits: Draft = {
    ...draft,
    id: "second",
    when: {
      join: "all",
      of: [
        { kind: "rule", values: { id: "first" }, delay: 0, edge: "none" },
        { kind: "time", values: { after: 9 }, delay: 2, edge: "rising" },
      ],
      delay: 0,
      edge: "none",
    },
  };
  const made = foreseen(document, [
    { kind: "set_rule", rule: ruleOf(draft) },
    { kind: "set_rule", rule: ruleOf(waits) },
    { kind: "set_rule", rule: ruleOf({ ...draft, id: "begin" }), instead_of: "first" },
  ]);
  expect(made?.rules.map(draftOf)).toEqual([
    { ...draft, id: "begin" },
    {
      ...waits,
      when: {
        ...waits.when,
        of: [
          { kind: "rule", values: { id: "begin" }, delay: 0, edge: "none" },
          { kind: "time", values: { after: 9 }, delay: 2, edge: "rising" },
        ],
      },
    },
  ]);
  expect(made?.rules[0]).toMatchObject({ times: 1, when: { delay: 0, edge: "none" } });
});

test("control, offset and stages of lights are foreseen, and lights given back to the map", () => {
  const timed = foreseen(document, [
    { kind: "set_signal_control", control: "actuated" },
    { kind: "set_timing", junction: "j1", control: "fixed" },
    { kind: "set_offset", junction: "j1", offset: 5 },
    { kind: "set_timing", junction: "j2", bus_priority: true },
    { kind: "clear_timing", junction: "j2" },
  ]);
  if (!timed) throw new Error();
  expect(timed.signals).toMatchObject({
    control: "actuated",
    junctions: [{ junction: "j1", control: "fixed", offset: 5, stages: [], bus_priority: null }],
  });
  const stage = { id: "A", green: 20, on_call: false } as never;
  const own = foreseen(timed, [
    { kind: "set_timing", junction: "j1", stages: [stage] },
    { kind: "set_stage", junction: "j1", stage: "A", on_call: true },
  ]);
  expect(own?.signals.junctions[0]?.stages).toEqual([{ id: "A", green: 20, on_call: true }]);
  const unknown: Edit[] = [
    { kind: "set_stage", junction: "j1", stage: "B", on_call: true },
    { kind: "set_offset", junction: "j1", offset: 5, plan: "morning" },
    { kind: "set_green", junction: "j1", stage: "A", green: 9 },
  ];
  for (const edit of unknown) expect(foreseen(timed, [edit])).toBeNull();
});

test("another preset of the weather drops the values that differed from the last", () => {
  const rain = foreseen(document, [
    { kind: "set_environment", parameters: { fog_density: 9 } },
    { kind: "set_environment", affects_driving: false },
  ]);
  expect(rain?.environment).toMatchObject({ parameters: { fog_density: 9 }, affects_driving: false });
  const noon = rain && foreseen(rain, [{ kind: "set_environment", preset: "WetNoon" }]);
  expect(noon?.environment).toEqual({ preset: "WetNoon", parameters: {}, affects_driving: false });
});

test("changes without a server are all kept, and made again in their order", async () => {
  const [server, store] = await opened();
  const { edit } = store.getState();
  const done = [edit({ kind: "set_seed", seed: 7 }), edit({ kind: "remove_actors", actors: ["a"] })];
  await server.answer({}, 503);
  await server.answer({}, 503);
  await Promise.all(done);
  expect(store.getState()).toMatchObject({ saving: "failed", scenario: { document } });
  const again = store.getState().refusal?.again?.();
  await server.answer(told(1, change("replace", "/seed", 7)));
  await server.answer(told(2, change("remove", "/actors/0")));
  await again;
  expect(store.getState()).toMatchObject({ saving: "saved", refusal: null, scenario: { version: 3 } });
  expect(server.asked.filter(({ body }) => body).map(({ body }) => body?.version)).toEqual([1, 1, 1, 2]);
});

test("the documents before and after are known until something else is done", () => {
  const [one, two, three] = [1, 2, 3].map((seed) => ({ ...document, seed }));
  if (!one || !two || !three) throw new Error();
  const line = new Timeline();
  line.begin(one);
  expect(line.look(-1)).toBeNull();
  line.grow(two);
  line.grow(three);
  expect([line.look(-1), line.look(-2)]).toEqual([two, one]);
  line.move(-1, two);
  expect([line.look(-1), line.look(1)]).toEqual([one, three]);
  line.grow(one);
  expect(line.look(1)).toBeNull();
  line.move(1, three); // made elsewhere
  expect([line.look(0), line.look(-1)]).toEqual([three, null]);
});

/** A server that answers when it is told to, each kind of request on its own. */
class Server {
  readonly asked: { url: string; body: { version: number } | null }[] = [];
  private readonly waiting: ((answer: Response) => void)[] = [];
  problems: object = { version: 0, problems: [] };

  constructor(private readonly begin: ScenarioState) {
    stubFetch(({ path: url, body: sent }) => {
      const body = (sent ?? null) as { version: number } | null;
      this.asked.push({ url, body });
      if (url.endsWith("/problems")) return Response.json(this.problems);
      if (!body) return Response.json(this.begin);
      return new Promise<Response>((resolve) => this.waiting.push(resolve));
    });
  }

  async answer(body: object, status = 200): Promise<void> {
    await vi.waitFor(() => expect(this.waiting).not.toHaveLength(0));
    this.waiting.shift()?.(Response.json(body, { status }));
  }
}

const begin: ScenarioState = {
  name: "s",
  version: 1,
  document,
  problems: [],
  label: "",
  undo: null,
  redo: null,
};
const told = (before: number, ...changes: DocumentChange[]): object => ({
  name: "s",
  before,
  version: before + 1,
  changes,
  label: "l",
  undo: "l",
  redo: null,
});

async function opened(): Promise<[Server, ReturnType<typeof createEditorStore>]> {
  const server = new Server(begin);
  const store = createEditorStore("s");
  await store.getState().load();
  return [server, store];
}
beforeEach(() => vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] }));
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("a move is shown before the server answers, and then as the server says it is", async () => {
  const [server, store] = await opened();
  const done = store.getState().edit({ kind: "move_actor", actor: "a", spawn: "n" });
  expect(store.getState()).toMatchObject({ saving: "saving", scenario: { version: 1 } });
  const shown = store.getState().scenario?.document;
  expect(shown?.actors[0]?.spawn).toBe("n");
  await server.answer(told(1, change("replace", "/actors/0/spawn", "n")));
  expect((await done)?.version).toBe(2);
  expect(store.getState()).toMatchObject({ saving: "saved", scenario: { version: 2, undo: "l" } });
  // As foreseen: nothing is drawn anew.
  expect(store.getState().scenario?.document).toBe(shown);
});

test("what is refused is taken back, and what was asked for after it stays", async () => {
  const [server, store] = await opened();
  const { edit } = store.getState();
  const first = edit({ kind: "move_actor", actor: "a", spawn: "taken" });
  const second = edit({ kind: "change_actor", actor: "b", depart: 8 });
  const actors = () => store.getState().scenario?.document.actors.map(({ spawn, depart }) => [spawn, depart]);
  const start = document.actors[0]?.spawn;
  expect(actors()?.slice(0, 2)).toEqual([
    ["taken", 0],
    [start, 8],
  ]);
  await server.answer({ error: { kind: "ScenarioError", message: "the node is taken" } }, 422);
  expect(await first).toBeNull();
  expect(actors()?.slice(0, 2)).toEqual([
    [start, 0],
    [start, 8],
  ]);
  await server.answer(told(1, change("replace", "/actors/1/depart", 8)));
  await second;
  expect(actors()?.[1]).toEqual([start, 8]);
  expect(server.asked.filter(({ body }) => body).map(({ body }) => body?.version)).toEqual([1, 1]);
});

test("an edit without a server is taken back, said, and can be made again", async () => {
  const [server, store] = await opened();
  const done = store.getState().edit({ kind: "remove_actors", actors: ["a"] });
  expect(store.getState().scenario?.document.actors).toHaveLength(2);
  await server.answer({}, 503);
  await done;
  expect(store.getState()).toMatchObject({ saving: "failed", scenario: { document } });
  const again = store.getState().refusal?.again?.();
  expect(store.getState().scenario?.document.actors).toHaveLength(2);
  await server.answer(told(1, change("remove", "/actors/0")));
  await again;
  expect(store.getState()).toMatchObject({ saving: "saved", refusal: null, scenario: { version: 2 } });
});

test("undo and redo show at once what this page has seen, and the versions go on growing", async () => {
  const [server, store] = await opened();
  const { edit, undo, redo } = store.getState();
  const done = edit({ kind: "set_clock", clock: 7 });
  const clock = () => store.getState().scenario?.document.demand.clock;
  expect(clock()).toBe(0); // only the server knows that
  await server.answer(told(1, change("replace", "/demand/clock", 7)));
  await done;
  expect(clock()).toBe(7);
  const steps = [undo(), redo(), undo()];
  expect(clock()).toBe(0);
  for (const [before, made] of [
    [2, 0],
    [3, 7],
    [4, 0],
  ] as const)
    await server.answer(told(before, change("replace", "/demand/clock", made)));
  await Promise.all(steps);
  expect(store.getState()).toMatchObject({ saving: "saved", scenario: { version: 5, document } });
});

test("changes that do not follow on what the page has are not made: the whole is loaded", async () => {
  const [server, store] = await opened();
  const done = store.getState().edit({ kind: "set_seed", seed: 7 });
  await server.answer(told(4, change("replace", "/seed", 7)));
  await done;
  expect(server.asked.at(-1)).toEqual({ url: "/api/scenarios/s", body: null });
  expect(store.getState().scenario?.document).toEqual(document);
});

test("problems follow when nothing more is changed, and are about the document they were found in", async () => {
  const [server, store] = await opened();
  const { edit } = store.getState();
  const found = [{ severity: "error", code: "c", where: "actors[1]", message: "m", nodes: [], segments: [] }];
  server.problems = { version: 3, problems: found };
  const both = [
    edit({ kind: "change_actor", actor: "a", depart: 1 }),
    edit({ kind: "change_actor", actor: "a", depart: 2 }),
  ];
  await server.answer(told(1, change("replace", "/actors/0/depart", 1)));
  await server.answer(told(2, change("replace", "/actors/0/depart", 2)));
  await Promise.all(both);
  await vi.advanceTimersByTimeAsync(100);
  await vi.waitFor(() => expect(store.getState().scenario?.problems).toEqual(found));
  expect(server.asked.filter(({ url }) => url.endsWith("/problems"))).toHaveLength(1);
  const removed = edit({ kind: "remove_actors", actors: ["a"] });
  const { checked, scenario: now } = store.getState();
  expect([checked?.actors[1]?.id, now?.document.actors[1]?.id]).toEqual(["b", "c"]);
  await server.answer(told(3, change("remove", "/actors/0")));
  await removed;
});
