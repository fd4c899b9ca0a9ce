import { expect, test } from "vitest";

import type { Actor, Edit, Flow, ScenarioDocument } from "../../src/api/types";
import { changesOf } from "../../src/editor/changes";
import { handlerFor } from "../../src/editor/handlers";
import { copyTool } from "../../src/editor/handlers/copy";
import { flowTool } from "../../src/editor/handlers/flow";
import { goalTool } from "../../src/editor/handlers/goal";
import type { Editing, Tool } from "../../src/editor/handlers/handler";
import { moveTool } from "../../src/editor/handlers/move";
import { placeTool } from "../../src/editor/handlers/place";
import { waypointTool } from "../../src/editor/handlers/waypoint";
import type { Picked, PickBy, PlacePick } from "../../src/editor/pick";
import { everyone, Starts } from "../../src/editor/placing";
import { suggestedGoals } from "../../src/editor/useScene";
import { insideRows, sceneActors, sceneFlows, type Step } from "../../src/editor/scene";
import { inBounds, inCircle, inRing } from "../../src/map/areas";
import type { Pointed } from "../../src/map/MapCanvas";
import { Picker } from "../../src/map/picking";
import type { AskedRemoval } from "../../src/editor/uses";
import { Heads } from "../../src/signals/heads";
import { actor, flow, graph, place, scenario } from "../example";
import { detector, program } from "../signals/program";

/** Everything that a handler has asked of the editor. */
class Log {
  edits: (Edit | readonly Edit[])[] = [];
  labels: (string | undefined)[] = [];
  said: string[] = [];
  steps: Step[] = [];
  selected: (readonly string[])[] = [];
  lights: string[] = [];
  asked: AskedRemoval[] = [];
  done = 0;
}

const picker = new Picker(graph);
const NOT_PICKING: PlacePick = {
  now: null,
  start: () => undefined,
  stop: () => undefined,
  begin: () => undefined,
  taker: { current: () => undefined },
};

function editing(document: ScenarioDocument, log: Log, more: Partial<Editing> = {}): Editing {
  const ones = everyone(document);
  const starts = new Starts(graph, picker, insideRows(graph, document.roi), document);
  const none = new Set<string>();
  return {
    graph,
    light: null,
    program: null,
    detectors: [],
    picker,
    roi: document.roi,
    ones,
    starts,
    sizeOf: () => [4, 1.8],
    region: { inside: document.roi, candidates: [], removable: document.roi, current: true },
    actors: sceneActors(graph, document, null, none, none),
    flows: sceneFlows(graph, document, none, none),
    selection: [],
    one: null,
    goals: null,
    legs: [],
    lights: null,
    showLight: (junction) => log.lights.push(junction),
    changes: changesOf({
      graph,
      roi: document.roi,
      ones,
      document,
      starts,
      say: (text) => log.said.push(text),
      ask: (removal) => log.asked.push(removal),
      edit: (edit, label) => {
        log.edits.push(edit);
        log.labels.push(label);
        return Promise.resolve(null);
      },
    }),
    pick: NOT_PICKING,
    select: (ids) => log.selected.push(ids),
    openStep: (step) => log.steps.push(step),
    openActors: () => log.steps.push("actors"),
    done: () => {
      log.done += 1;
    },
    say: (text) => log.said.push(text),
    ...more,
  };
}

/** A traffic light of junction 10 with its head at a place. */
const lightAt = (x: number, y: number): Heads =>
  new Heads([
    {
      id: "J1",
      names: ["10"],
      green: [],
      signals: [],
      paths: [
        [
          [x, y],
          [x + 1, y],
        ],
      ],
      walks: [false],
    },
  ]);

const at = (x: number, y: number, shift = false): Pointed => ({ x, y, reach: 0.5, shift });
/** Centred on its lane, so that it is found where its start is. */
const car = (id: string, spawn: string): Actor => ({ ...actor(id, spawn), lateral_offset: 0 });
const [FIRST, SECOND] = ["1.0.-1.0", "1.0.-1.1"];

function using(
  tool: Tool | null,
  document: ScenarioDocument,
  more: Partial<Editing> = {},
  step: Step = "actors",
) {
  const log = new Log();
  return { log, handler: handlerFor(step, tool, editing(document, log, more)) };
}

test("in the step of the region a click adds a segment, or takes out one of the region", () => {
  const { log, handler } = using(null, scenario([], ["a"]), {}, "region");
  handler.pick(at(2, 0));
  handler.pick(at(0, 0));
  handler.pick(at(900, 900));
  expect(log.edits).toEqual([
    { kind: "grow_roi", segment: "b" },
    { kind: "shrink_roi", segment: "a" },
  ]);
  expect(handler.aim).toBe(true);
});

test("a segment that holds the region together says so before it is clicked", () => {
  const { handler } = using(
    null,
    scenario([], ["a", "b", "c"]),
    {
      region: { inside: ["a", "b", "c"], candidates: [], removable: ["a", "c"], current: true },
    },
    "region",
  );
  expect(handler.hint(handler.under(at(2, 0)))).toContain("holds the region together");
  expect(handler.hint(handler.under(at(4, 0)))).toBe("Click to take this segment out of the region");
});

test("a click on a signal inside the region shows its program and takes nothing out of the region", () => {
  const { x, y } = place(FIRST);
  const lights = lightAt(x, y);
  const { log, handler } = using(null, scenario([], ["a"]), { lights }, "region");
  expect(handler.hint(handler.under(at(x, y)))).toBe(
    "Traffic light at Junction 10: click to see its program",
  );
  handler.pick(at(x, y));
  expect([log.edits, log.lights, log.steps]).toEqual([[], ["10"], ["lights"]]);
  // Away from the signal it is said what a click would do; outside the region a signal stops no click.
  expect(handler.hint({ is: "segment", row: 0 })).toBe("Click to take this segment out of the region");
  const outside = using(null, scenario([], ["c"]), { lights }, "region");
  outside.handler.pick(at(x, y));
  expect([outside.log.edits, outside.log.lights]).toEqual([[{ kind: "grow_roi", segment: "a" }], []]);
});

test("in the step of the lights a click anywhere on a junction shows its program", () => {
  const { x, y } = place(FIRST);
  const { log, handler } = using(null, scenario([], ["a"]), { lights: lightAt(x, y) }, "lights");
  handler.pick(at(x + 25, y));
  handler.pick(at(x + 900, y));
  expect(log.lights).toEqual(["10"]);
  expect(handler.hint(null)).toBe("Click a junction with a traffic light to see its program");
});

test("a rectangle in the step of the region adds what lies in it and hangs together", () => {
  const { log, handler } = using(null, scenario([], []), {}, "region");
  handler.frame(inBounds([-1, -1, 1, 1]));
  handler.frame(inBounds([50, 50, 60, 60]));
  expect(log.edits).toEqual([{ kind: "extend_roi", segments: ["a"] }]);
  expect(log.labels).toEqual(["Add 1 segment"]);
  expect(log.said).toEqual([
    "There is nothing to add here: no segment lies in it, or all are in the region.",
  ]);
});

test("with no region yet the map says how to begin it", () => {
  const { handler } = using(null, scenario([], []), {}, "region");
  expect(handler.hint(null)).toBe(
    "Click a road or junction to begin the region, or drag a rectangle with Shift, a line around it with Ctrl",
  );
});

test("in the step of the traffic the map shows ids for tables and a click changes nothing", () => {
  const { log, handler } = using(null, scenario([]), {}, "traffic");
  expect(handler.hint(handler.under(at(2, 0)))).toBe("Id for tables: b");
  expect(handler.hint(null)).toBeNull();
  handler.pick(at(2, 0));
  expect(log).toEqual(new Log());
});

test("a kind is placed on the nearest free start", () => {
  const { log, handler } = using(placeTool("bus"), scenario([car("a", FIRST)], ["a", "b"]));
  handler.pick(at(2, 1));
  expect(log.edits).toEqual([{ kind: "add_actor", category: "bus", spawn: SECOND }]);
  expect(handler).toMatchObject({ walks: false, badge: "bus", aim: true });
});

test("pedestrians are placed on walkways, vehicles on lanes", () => {
  const { log, handler } = using(placeTool("pedestrian"), scenario([]));
  handler.pick(at(0, 8.5));
  expect(log.edits).toEqual([{ kind: "add_actor", category: "pedestrian", spawn: "ped.1.0.3.0" }]);
  expect(handler.walks).toBe(true);
});

test("lane and compass heading of the start are said before the click", () => {
  const { handler } = using(placeTool("car"), scenario([]));
  expect(handler.hint(null)).toBe("Point at the lane where the car starts");
  expect(handler.hint(handler.under(at(0, 0)))).toBe("Road 1, right lane 1, heading 90°");
});

test("a click where nothing can start says why, and without a region leads to it", () => {
  const outside = using(placeTool("car"), scenario([], ["c"]));
  outside.handler.pick(at(0, 0));
  expect(outside.log.said).toEqual(["No car may start on this lane."]);
  const without = using(placeTool("car"), scenario([], []));
  without.handler.pick(at(0, 0));
  expect(without.log.steps).toEqual(["region"]);
  expect(without.log.edits).toEqual([]);
});

test("with a tool in the hand a click on a goal of the one before places the next one there", () => {
  const one = car("a", FIRST);
  const more = { selection: ["a"], one, goals: [place(SECOND)] };
  const placing = using(placeTool("car"), scenario([one], ["a", "b"]), more);
  placing.handler.pick(at(0, 0));
  expect(placing.log.selected).toEqual([["a"]]);
  placing.handler.pick(at(2.1, 0));
  expect(placing.log.edits).toEqual([{ kind: "add_actor", category: "car", spawn: SECOND }]);
});

test("a tool is used on the next free start by those who do not point", () => {
  const log = new Log();
  placeTool("car")
    .handler(editing(scenario([car("a", FIRST)], ["a", "b"]), log))
    .somewhere();
  expect(log.edits).toEqual([{ kind: "add_actor", category: "car", spawn: SECOND }]);
  const full = new Log();
  placeTool("car")
    .handler(editing(scenario([car("a", FIRST)], ["a"]), full))
    .somewhere();
  expect(full.said).toEqual(["No free point is left inside the region."]);
});

test("a flow has vehicles or pedestrians by where it starts", () => {
  const vehicles = using(flowTool(false), scenario([]));
  vehicles.handler.pick(at(0, 0));
  const pedestrians = using(flowTool(true), scenario([]));
  pedestrians.handler.pick(at(0, 9));
  expect([...vehicles.log.edits, ...pedestrians.log.edits]).toEqual([
    { kind: "add_flow", spawn: FIRST, per_hour: 300, mix: { car: 1 } },
    { kind: "add_flow", spawn: "ped.1.0.3.0", per_hour: 300, mix: { pedestrian: 1 } },
  ]);
  expect(pedestrians.handler.hint(null)).toBe("Point at the edge of a road where the pedestrian flow starts");
});

test("a copy is made once and does not take goals for places", () => {
  const one = car("a", FIRST);
  const { log, handler } = using(copyTool(["a"]), scenario([one], ["a", "b"]), {
    one,
    goals: [place(SECOND)],
  });
  handler.pick(at(2.1, 0));
  expect(log.edits).toEqual([{ kind: "copy_actors", copies: { [SECOND]: "a" } }]);
  expect(log).toMatchObject({ labels: ["Copy a"], done: 1 });
});

test("of several that are moved those that find no free start in the region are left out, and it is said", () => {
  const flows = [flow("f", "ped.1.0.3.0")];
  const free = using(moveTool(["a", "f"]), scenario([car("a", FIRST)], ["a", "b"], flows));
  free.handler.pick(at(2.1, 0));
  const [a, f] = [
    { kind: "move_actor", actor: "a", spawn: SECOND },
    { kind: "change_flow", flow: "f", spawn: "ped.1.0.3.1" },
  ];
  expect(free.log).toMatchObject({ edits: [[a, f]], labels: ["Move 2 road users"], done: 1 });
  const full = using(
    moveTool(["a", "f"]),
    scenario([car("a", FIRST), car("q", "ped.1.0.3.1")], ["a", "b"], flows),
  );
  full.handler.pick(at(2.1, 0));
  expect(full.log).toMatchObject({
    edits: [[a]],
    said: ["1 road user found no free point in the region and was left out."],
  });
});

test("without a tool a click selects, with Shift it adds and takes out, and on the empty map it clears", () => {
  const document = scenario([car("a", FIRST), car("b", SECOND)]);
  const { log, handler } = using(null, document, { selection: ["a"] });
  handler.pick(at(2, 0));
  handler.pick(at(2, 0, true));
  handler.pick(at(0, 0, true));
  handler.pick(at(50, 50, true));
  handler.pick(at(50, 50));
  expect(log.selected).toEqual([["b"], ["a", "b"], [], []]);
});

test("a click opens the step of the road users, whatever was open", () => {
  for (const step of ["map", "environment", "run"] as const) {
    const { log, handler } = using(null, scenario([]), {}, step);
    handler.pick(at(50, 50));
    expect(log.steps).toEqual(["actors"]);
  }
});

test("a goal of the selected one is set by a click on it", () => {
  const source: Flow = flow("f", FIRST);
  const { log, handler } = using(null, scenario([], ["a"], [source]), {
    one: source,
    goals: [place(SECOND)],
  });
  handler.pick(at(2.2, 0));
  expect(log.edits).toEqual([{ kind: "change_flow", flow: "f", goal: SECOND }]);
});

const THIRD = "1.0.-1.2";

test("a goal is chosen among those that are suggested, or anywhere in the region", () => {
  const one = car("a", FIRST);
  const more = { selection: ["a"], one, goals: [place(THIRD)] };
  const { log, handler } = using(goalTool("a"), scenario([one], ["a", "b", "c"]), more);
  // Within reach of the suggestion it is meant, though another point is nearer.
  expect(handler.under({ ...at(2.9, 0), reach: 1.5 })).toEqual({
    is: "place",
    place: place(THIRD),
    trial: [FIRST, THIRD],
  });
  const free = handler.under(at(2.1, 0));
  expect(free).toMatchObject({ place: { id: SECOND }, trial: [FIRST, SECOND] });
  expect(handler.hint(free)).toBe("a goes to Road 1, right lane 1, 2 m");
  handler.pick(at(2.1, 0));
  expect(log.edits).toEqual([{ kind: "set_goal", actor: "a", goal: SECOND }]);
  expect(log.done).toBe(1);
});

test("the start itself is no goal, nor is a point outside the region", () => {
  const one = car("a", FIRST);
  const { log, handler } = using(goalTool("a"), scenario([one], ["a"]), { selection: ["a"], one, goals: [] });
  expect(handler.under(at(0, 0))).toBeNull();
  handler.pick(at(2, 0));
  expect(log.edits).toEqual([]);
  expect(log.said).toEqual(["No goal can be here: it lies on a lane or walkway inside the region."]);
  expect(log.done).toBe(0);
});

test("those who do not point take the first goal that is suggested", () => {
  const log = new Log();
  const one = car("a", FIRST);
  const more = { selection: ["a"], one, goals: [place(SECOND), place(THIRD)] };
  goalTool("a")
    .handler(editing(scenario([one], ["a", "b"]), log, more))
    .somewhere();
  expect(log.edits).toEqual([{ kind: "set_goal", actor: "a", goal: SECOND }]);
});

test("the flag of the goal is taken along by a drag, with the route as it would be", () => {
  const one: Actor = { ...car("a", FIRST), goal: THIRD };
  const more = { selection: ["a"], one, goals: [place(THIRD)] };
  const { log, handler } = using(null, scenario([one], ["a", "b", "c"]), more);
  const carried = handler.grab(at(4, 0));
  expect(carried?.hint).toContain("the goal of a");
  expect(carried?.under(at(2.2, 0))).toMatchObject({ trial: [FIRST, SECOND] });
  carried?.drop(at(2.2, 0));
  expect(log.edits).toEqual([{ kind: "set_goal", actor: "a", goal: SECOND }]);
});

test("a road user that is dragged shows the route from where it would start", () => {
  const one: Actor = { ...car("a", FIRST), goal: THIRD };
  const { handler } = using(null, scenario([one], ["a", "b", "c"]), { selection: ["a"], one });
  expect(handler.grab(at(0, 0))?.under(at(2.2, 0))).toMatchObject({ trial: [SECOND, THIRD] });
});

test("a rectangle selects all road users and flows in it", () => {
  const { log, handler } = using(null, scenario([car("a", FIRST)], ["a"], [flow("f", SECOND)]));
  handler.frame(inBounds([-1, -1, 3, 1]));
  handler.frame(inBounds([1, -1, 3, 1]));
  expect(log.selected).toEqual([["a", "f"], ["f"]]);
});

test("a line around road users selects those inside, and a circle takes segments into the region", () => {
  const { log, handler } = using(null, scenario([car("a", FIRST), car("b", THIRD)], ["a", "c"]));
  const around = inRing([
    [3, -1],
    [5, -1],
    [4.5, 2],
  ]);
  handler.frame(around);
  expect(log.selected).toEqual([["b"]]);
  // Crossing itself, a line leaves out what it goes round twice.
  const twice = [
    [0, 0],
    [4, 0],
    [4, 4],
    [0, 4],
  ] as const;
  expect(inRing([...twice, ...twice])(2, 2)).toBe(false);
  expect(inRing(twice)(2, 2)).toBe(true);
  expect([inCircle({ x: 1, y: 1 }, 2)(3, 1), inCircle({ x: 1, y: 1 }, 2)(3.1, 1)]).toEqual([true, false]);
});

const LEGS = [
  [
    [0, 0],
    [4, 0],
  ],
] as const;

test("a route is led through another place by a drag, and a waypoint is moved", () => {
  const one: Actor = { ...car("a", FIRST), goal: THIRD };
  const document = scenario([one], ["a", "b", "c"]);
  const { log, handler } = using(null, document, { selection: ["a"], one, legs: LEGS });
  expect(handler.hint(handler.under(at(3, 0.2)))).toContain("Drag the route of a");
  expect(handler.under(at(3, 0.4))).toBeNull();
  const carried = handler.grab(at(3, 0.1));
  expect(carried?.needsRoute).toBe(true);
  expect(carried?.under(at(2.1, 0))).toMatchObject({ trial: [FIRST, SECOND, THIRD] });
  carried?.drop(at(2.1, 0));
  carried?.drop(at(900, 900));
  const led: Actor = { ...one, via: [SECOND] };
  const again = using(null, scenario([led], ["a", "b", "c"]), {
    selection: ["a"],
    one: led,
    actors: [],
    legs: [LEGS[0], LEGS[0]],
  });
  again.handler.grab(at(2, 0))?.drop(at(4, 0));
  expect([...log.edits, ...again.log.edits]).toEqual([
    { kind: "change_actor", actor: "a", via: [SECOND] },
    { kind: "change_actor", actor: "a", via: [THIRD] },
  ]);
  expect(log.said).toEqual(["No route leads here: a waypoint lies on a lane or walkway inside the region."]);
});

test("a waypoint is chosen by a click, or in the middle of the route; flows have none", () => {
  const one: Actor = { ...car("a", FIRST), goal: THIRD, via: [FIRST] };
  const more = { selection: ["a"], one, legs: [[], LEGS[0]] };
  const { log, handler } = using(waypointTool("a"), scenario([one], ["a", "b", "c"]), more);
  handler.pick(at(2.1, 0));
  expect(log.edits).toEqual([{ kind: "change_actor", actor: "a", via: [FIRST, SECOND] }]);
  expect(log.done).toBe(1);
  const source = flow("f", FIRST);
  const of = using(null, scenario([], ["a"], [source]), { one: source, legs: LEGS });
  expect(of.handler.grab(at(3, 0))).toBeNull();
  const none = new Log();
  waypointTool("a")
    .handler(editing(scenario([one]), none, { one }))
    .somewhere();
  expect(none.said).toEqual(["There is no route yet: choose a goal first."]);
});

test("a drag takes a road user to a free start, and those that are selected with it", () => {
  const document = scenario([car("a", FIRST), car("p", "ped.1.0.3.0")], ["a", "b"]);
  const { log, handler } = using(null, document, { selection: ["a", "p"] });
  expect(handler.grab(at(50, 50))).toBeNull();
  const carried = handler.grab(at(0, 9));
  expect(carried?.under(at(2, 9))).toEqual({ is: "place", place: place("ped.1.0.3.1") });
  carried?.drop(at(2, 9));
  // The one that was dragged leads: the other keeps its distance to it.
  expect(log.edits).toEqual([
    [
      { kind: "move_actor", actor: "p", spawn: "ped.1.0.3.1" },
      { kind: "move_actor", actor: "a", spawn: SECOND },
    ],
  ]);
});

test("a drag that begins on a road user that is not selected moves the map, not the road user", () => {
  const { handler } = using(null, scenario([car("a", FIRST)]));
  expect(handler.grab(at(0, 0))).toBeNull();
  const other = using(null, scenario([car("a", FIRST)]), { selection: ["b"] });
  expect(other.handler.grab(at(0, 0))).toBeNull();
});

test("a road user that rules and criteria are about is removed with them or without, once that is said", () => {
  const rule = {
    id: "brake",
    actor: "b",
    when: { kind: "ttc", to: "a", below: 3 },
    then: [{ kind: "stop" }],
  };
  const other = { ...rule, id: "else", when: { kind: "time", after: 3 } };
  const document = {
    ...scenario([car("a", FIRST), car("b", SECOND)]),
    rules: [rule, other] as never,
    criteria: ["min_ttc(a) >= 1.5 s", "collisions == 0"],
  };
  const { log } = using(null, document);
  const { changes } = editing(document, log);
  changes.remove(["a"]);
  expect(log.edits).toEqual([]);
  expect(log.asked).toEqual([{ ids: ["a"], uses: { rules: ["brake"], criteria: [0] } }]);
  changes.remove(["a"], log.asked[0]?.uses);
  changes.remove(["a"], { rules: [], criteria: [] });
  expect(log.edits).toEqual([
    [
      { kind: "remove_actors", actors: ["a"] },
      { kind: "remove_rule", rule: "brake" },
      { kind: "set_criteria", criteria: ["collisions == 0"] },
    ],
    [{ kind: "remove_actors", actors: ["a"] }],
  ]);
});

test("a road user that is dropped where none can start stays, and the reason is said", () => {
  const { log, handler } = using(null, scenario([car("a", FIRST)]), { selection: ["a"] });
  handler.grab(at(0, 0))?.drop(at(900, 900));
  expect(log.edits).toEqual([]);
  expect(log.said).toHaveLength(1);
});

test("with a tool in the hand, and where segments are pointed at, a drag moves the map", () => {
  const document = scenario([car("a", FIRST)]);
  expect(using(placeTool("car"), document).handler.grab(at(0, 0))).toBeNull();
  expect(using(null, document, {}, "region").handler.grab(at(0, 0))).toBeNull();
  expect(using(null, document, {}, "traffic").handler.grab(at(0, 0))).toBeNull();
});

test("a detector is dragged along its lane, also in the step of the lights", () => {
  const place: [number, number][] = [
    [20, 0],
    [22, 0],
  ];
  const lane = {
    id: "1.0.-1",
    approach: "r1",
    line: [[0, 0] as [number, number], [50, 0] as [number, number]],
  };
  const more = {
    light: "10",
    program: { ...program(), detectors: [detector("J1.D1.0", { place })], lanes: [lane] },
    detectors: [{ id: "D1", at: "1.0.-1", before: 28, length: 2 }],
  } as unknown as Partial<Editing>;
  for (const step of ["lights", "study"] as const) {
    const { handler } = using(null, scenario([]), more, step);
    expect(handler.grab(at(22, 0))?.hint).toBe("Moving detector D1 along its lane");
    expect(handler.grab(at(40, 30))).toBeNull();
  }
});

test("the same tool is known again, and only one that makes something new clears the selection", () => {
  expect(placeTool("car").key).toBe(placeTool("car").key);
  const tools = [
    placeTool("car"),
    placeTool("bus"),
    flowTool(false),
    flowTool(true),
    copyTool(["a"]),
    moveTool(["a"]),
    goalTool("a"),
  ];
  expect(new Set(tools.map(({ key }) => key)).size).toBe(tools.length);
  expect(tools.map(({ makes }) => makes)).toEqual([true, true, true, true, false, false, false]);
});

test("a click on a traffic light shows its program, unless something is placed or stands there", () => {
  const log = new Log();
  const { x, y } = place(FIRST);
  const lights = lightAt(x, y);
  const free = editing(scenario([]), log, { lights });
  const handler = handlerFor("traffic", null, free);
  expect(handler.hint(handler.under(at(x, y)))).toBe(
    "Traffic light at Junction 10: click to see its program",
  );
  handler.pick(at(x, y));
  expect(log.lights).toEqual(["10"]);
  const taken = editing(scenario([car("a", FIRST)]), log, { lights });
  handlerFor("actors", null, taken).pick(at(x, y));
  handlerFor("actors", placeTool("car"), free).pick(at(x, y));
  expect(log.lights).toEqual(["10"]);
  expect(log.selected).toContainEqual(["a"]);
});

/** What is picked by clicks of a kind, of a turn with its first segment; and what was said. */
function picked(
  by: PickBy,
  points: [number, number][],
  more: Partial<Editing> = {},
  from: string | null = null,
) {
  const found: Picked[] = [];
  const begun: string[] = [];
  const pick: PlacePick = {
    ...NOT_PICKING,
    now: { key: "k", by, from },
    begin: (segment) => begun.push(segment),
    taker: { current: (one) => found.push(one) },
  };
  const { log, handler } = using(null, scenario([], ["a"]), { pick, ...more }, "measures");
  for (const [x, y] of points) handler.pick(at(x, y));
  return { found, begun, said: log.said };
}

test("a segment, a lane, a point of it and a node are picked by where the click is", () => {
  expect(picked("segment", [[2, 0]]).found).toMatchObject([{ name: "b", s: 0 }]);
  expect(picked("lane", [[2, 0]]).found).toMatchObject([{ name: "1.0.-1", s: 2 }]);
  expect(picked("point", [[4, 0]]).found).toMatchObject([{ name: "1.0.-1", s: 4 }]);
  expect(picked("node", [[0, 0]]).found).toMatchObject([{ name: "1.0.-1.0", s: 0 }]);
});

test("a node outside the region is not picked, nor a lane where there is none", () => {
  const outside = picked("node", [[900, 900]]);
  expect(outside.found).toEqual([]);
  expect(outside.said).toEqual(["There is no lane of the region here, or it lies in a junction."]);
  expect(picked("lane", [[900, 900]]).said).toEqual(["There is no lane here."]);
});

test("a turn is picked by two roads, one after the other", () => {
  expect(picked("turn", [[0, 0]])).toMatchObject({ begun: ["a"], found: [] });
  expect(picked("turn", [[4, 0]], {}, "a").found).toMatchObject([{ name: "a>c", s: 0 }]);
});

test("a place may be on a walkway or the ground, and the ground has no name", () => {
  expect(picked("place", [[4, 0]]).found).toMatchObject([{ name: graph.vehiclePlace(2).id }]);
  expect(picked("place", [[40, 90.123]]).found).toMatchObject([{ name: "", x: 40, y: 90.12 }]);
  expect(picked("goal", [[40, 90]]).found).toEqual([]);
  expect(picked("ground", [[4, 0]]).found).toMatchObject([{ name: "", x: 4, y: 0 }]);
});

test("goals are suggested while one is chosen and to who has none, not beside the goal that is set", () => {
  const goals = [place("1.0.-1.1"), place("1.0.-1.2")];
  const [without, has] = [actor("car-1"), { ...actor("car-2"), goal: "1.0.-1.1" }];
  expect(suggestedGoals(null, { ...without, goal: null }, goals)).toEqual(goals);
  expect(suggestedGoals(null, has, goals)).toEqual([]);
  expect(suggestedGoals(goalTool("car-2"), has, goals)).toEqual(goals);
  expect(suggestedGoals(placeTool("car"), { ...without, goal: null }, goals)).toEqual([]);
  expect(suggestedGoals(null, null, null)).toEqual([]);
});
