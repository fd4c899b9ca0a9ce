import { expect, test } from "vitest";

import type { Incident, ReplayColumns } from "../src/api/runs";
import { compared } from "../src/run/figures";
import { FIGURES } from "./figures";
import { markKind, marksAt, sentence } from "../src/run/incidents";
import { between, momentAt, Replay } from "../src/run/replay";
import { thinned, ticks } from "../src/run/scale";
import { hashOf, parseAddress } from "../src/ui/address";
import { summary } from "./messages";

const columns = (): ReplayColumns => ({
  times: [0, 1, 2],
  first: [0, 1, 3, 4],
  actor: [0, 0, 1, 1],
  x: [1_000_000, 1_000_010, 1_000_100, 1_000_900],
  y: [5, 5, 7, 7],
  hdg: [0, 0, 3.1, -3.1],
  speed: [10, 10, 5, 5],
  actors: [
    { id: "car-1", category: "car", length: 4, width: 2, ego: true },
    { id: "bus-1", category: "bus", length: 12, width: 2.5, ego: false },
  ],
});

const shown = (time: number): Record<string, [number, number]> => {
  const replay = new Replay(columns());
  const frame = replay.at(time);
  const { pose } = replay.crowd.arrange(frame, null);
  const found: Record<string, [number, number]> = {};
  for (const who of replay.crowd.all()) {
    const row = replay.crowd.row(who.id);
    if (row >= 0) found[who.id] = [pose[5 * row] ?? NaN, pose[5 * row + 1] ?? NaN];
  }
  return found;
};

test("the recording ends with the story, and says where that was", () => {
  const { times, first, ...rest } = columns();
  const idle = { ...rest, times: [...times, 3, 4, 5], first: [...first, 4, 4, 4] };
  const replay = new Replay(idle);
  expect([replay.begin, replay.end, replay.spacing]).toEqual([0, 3, 1]);
  expect(replay.extent()).toEqual([1_000_000, 5, 1_000_900, 7]);
  expect(new Replay({ ...rest, times: [0, 5], first: [0, 0, 0], actor: [] }).end).toBe(5);
  const many = Array.from({ length: 11 }, (_, n) =>
    rest.actors.map((one) => ({ ...one, id: `${n} ${one.id}` })),
  );
  expect(new Replay({ ...columns(), actors: many.flat() }).extent()).toBeNull();
});

test("between two moments every road user is under way, far from zero too", () => {
  expect(shown(0.5)).toEqual({ "car-1": [1_000_005, 5] });
  expect(shown(-3)).toEqual({ "car-1": [1_000_000, 5] });
});

test("who has not been recorded any more is gone with the next moment", () => {
  expect(Object.keys(shown(1.5)).sort()).toEqual(["bus-1", "car-1"]);
  expect(Object.keys(shown(2))).toEqual(["bus-1"]);
  expect(Object.keys(shown(99))).toEqual(["bus-1"]);
});

test("who was put elsewhere does not fly there", () => {
  expect(shown(1.9)["bus-1"]).toEqual([1_000_100, 7]);
});

test("headings turn the short way, and a bend is driven as a bend", () => {
  const a = { x: 0, y: 0, hdg: 3.1, speed: 1 };
  expect(Math.cos(between(a, { x: -1, y: 0, hdg: -3.1, speed: 1 }, 1, 0.5).hdg)).toBeCloseTo(-1, 5);
  // A quarter circle of radius 10 in a second: the chord's middle is 2.9 m off.
  const speed = 5 * Math.PI;
  const middle = between({ x: 0, y: 0, hdg: 0, speed }, { x: 10, y: 10, hdg: Math.PI / 2, speed }, 1, 0.5);
  expect(Math.hypot(middle.x, middle.y - 10)).toBeCloseTo(10, 0);
});

test("a run in which no road user was ever on the road can be replayed", () => {
  const empty = { ...columns(), times: [], first: [0], actor: [], x: [], y: [], hdg: [], speed: [] };
  expect(new Replay(empty).at(3).count).toBe(0);
});

test("the moment is the last one that is not later", () => {
  expect([-1, 0, 0.99, 1, 5].map((time) => momentAt([0, 1, 2], time))).toEqual([0, 0, 0, 1, 2]);
});

const crash: Incident = { time: 3, kind: "collision", actor: "car-1", partner: "x7", x: 1, y: 2 };

test("incidents are reported in words and marked from when they happen", () => {
  const categories = new Map([
    ["car-1", "car"],
    ["x7", "bicycle"],
  ] as const);
  expect(sentence(crash, categories)).toBe("car-1 collided with Bicycle x7");
  expect(marksAt([crash], 2.9)).toEqual([]);
  expect(marksAt([crash], 3)).toEqual([{ x: 1, y: 2, kind: "collision", fresh: true }]);
  expect(marksAt([crash], 30)[0]?.fresh).toBe(false);
  expect(marksAt([{ time: 0, kind: "emergency_stop", actor: "a" }], 1)).toEqual([]);
});

test("every kind of event is a sentence with a subject and has a mark of its own", () => {
  const begun: Incident = { time: 2, kind: "rule_started", actor: "van-1", rule: "cut-in", values: {} };
  const about = (values: Record<string, number>) => sentence({ ...begun, values }, new Map());
  expect(about({ ttc: 3 })).toBe("van-1 triggered rule cut-in (time to collision 3.0 s)");
  expect(about({ "all[0].speed": 10, "all[1].time": 2, "all[2].reaches": 4.2 })).toBe(
    "van-1 triggered rule cut-in (speed 36 km/h, distance 4.2 m)",
  );
  const jam: Incident = { time: 60, kind: "jam_begin", actor: "car-1", queue: 7, x: 1, y: 2 };
  const over: Incident = { time: 400, kind: "jam_end", actor: "", waited: 340 };
  const words = (incident: Incident) => sentence(incident, new Map());
  expect(words(jam)).toBe("A jam of 7 vehicles began at car-1");
  expect(words(over)).toBe("A jam ended after 6 min");
  expect(words({ ...over, waited: 42 })).toBe("A jam ended after 42 s");
  expect(words({ time: 1, kind: "measure_begin", actor: "works-1" })).toBe("Measure works-1 began");
  expect([jam, over].map(markKind)).toEqual(["jam", "jam"]);
  expect(markKind({ time: 1, kind: "measure_end", actor: "works-1" })).toBe("measure");
  expect(markKind({ time: 1, kind: "teleport_start", actor: "a" })).toBe("teleported");
});

test("two runs are compared figure by figure", () => {
  const before = summary(
    { sim_seconds: 60, figures: { mean_speed: 10, mean_delay: 1.5 } },
    { arrived: 5, collided: 0 },
  );
  const now = summary(
    { sim_seconds: 60, figures: { mean_speed: 10.5, mean_delay: null } },
    { arrived: 3, collided: 1 },
  );
  const found = Object.fromEntries(
    compared(now, before, FIGURES).map((one) => [one.label, [one.difference, one.better]]),
  );
  expect(found).toEqual({
    "Simulated time": ["same", null],
    Arrived: ["−2", false],
    "In collisions": ["+1", false],
    "Mean speed": ["+1.8 km/h", true],
    "Mean delay": ["–", null],
  });
});

test("axes have round numbers that hold everything", () => {
  expect(ticks(17)).toEqual([0, 5, 10, 15, 20]);
  expect(ticks(0.3)).toEqual([0, 0.1, 0.2, 0.3]);
  expect(ticks(0)).toEqual([0, 0.5, 1]);
});

test("a long table is thinned evenly with its end kept", () => {
  expect(thinned([0, 1, 2, 3, 4, 5, 6, 7, 8], 3)).toEqual([0, 4, 8]);
  expect(thinned([1, 2], 3)).toEqual([1, 2]);
});

test("the list of a scenario's runs has an address", () => {
  expect(parseAddress(hashOf({ view: "runs", scenario: "a/b ü" }))).toEqual({
    view: "runs",
    scenario: "a/b ü",
  });
});
