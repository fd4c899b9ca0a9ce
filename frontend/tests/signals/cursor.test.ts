import { expect, test } from "vitest";

import { changed, cursorAt, ShownSignal, type SignalNow } from "../../src/signals/cursor";
import { Heads } from "../../src/signals/heads";
import { plan } from "./program";

const now = (state: string, before: string | null, since: number | null, time: number): SignalNow => ({
  time,
  state,
  since,
  before,
  plan: null,
});

test("the cursor moves with the seconds of a state and stays at the end of a green that is prolonged", () => {
  expect(cursorAt(plan, now("gr", "rr", 100, 107))).toEqual({ second: 7, stage: 0, elapsed: 7 });
  expect(cursorAt(plan, now("rG", "rr", 100, 140))).toEqual({ second: 35, stage: 1, elapsed: 40 });
});

test("all red after the second stage is told from that after the first by what was shown before", () => {
  expect(cursorAt(plan, now("rr", "yr", 50, 51))?.second).toBe(19);
  expect(cursorAt(plan, now("rr", "ry", 50, 51))).toEqual({ second: 39, stage: null, elapsed: 1 });
});

test("a state that one began to look at has no seconds, and one of no plan no cursor", () => {
  expect(cursorAt(plan, now("rG", null, null, 60))).toEqual({ second: 20, stage: 1, elapsed: null });
  expect(cursorAt(plan, now("GG", null, null, 60))).toBeNull();
});

test("a log says what was shown, since when, and what before", () => {
  const log = new ShownSignal({
    light: "J1",
    times: [0, 15, 18, 20, 22],
    shown: [0, 1, 2, 3, 3],
    plans: ["day", "day", "day", "day", "evening"],
    states: ["gr", "yr", "rr", "rG"],
  });
  expect(log.at(-1)).toBeNull();
  expect(log.at(3)).toEqual({ time: 3, state: "gr", since: null, before: null, plan: "day" });
  expect(log.at(18)).toEqual({ time: 18, state: "rr", since: 18, before: "yr", plan: "day" });
  // The plan of the evening takes over in the midst of the green.
  expect(log.at(23)).toEqual({ time: 23, state: "rG", since: 20, before: "rr", plan: "evening" });
});

test("what is seen live is known for as long as it was seen to change", () => {
  const first = changed(undefined, "gr", 4);
  expect(first.since).toBeNull();
  expect(changed(first, "yr", 9)).toMatchObject({ since: 9, before: "gr", state: "yr" });
});

const light = {
  id: "J1",
  names: ["10"],
  green: [15, 15],
  signals: [],
  paths: [
    [
      [0, 0],
      [5, 0],
    ],
    [
      [0, 0],
      [5, 5],
    ],
    [
      [2, -4],
      [2, 4],
    ],
    [],
  ] as [number, number][][],
  walks: [false, false, true, false],
};

test("a lane has one head that shows the movement that may go most, a crossing one at each end", () => {
  const heads = new Heads([light]);
  const shown = heads.at((id) => (id === "J1" ? "rgGr" : undefined));
  expect(shown.map(({ x, y, walk, shown: what }) => [x, y, walk, what])).toEqual([
    [0, 0, false, "permissive"],
    [2, -4, true, "green"],
    [2, 4, true, "green"],
  ]);
  expect(heads.at(() => "yrru")[0]?.shown).toBe("yellow");
  expect(heads.at(() => undefined)).toEqual([]);
});

test("the light under the pointer is that of the nearest head within reach", () => {
  const heads = new Heads([
    light,
    {
      ...light,
      id: "J2",
      names: ["20"],
      paths: [
        [
          [9, 0],
          [12, 0],
        ],
      ],
    },
  ]);
  expect(heads.junctionAt({ x: 8, y: 0, reach: 1 })).toBe("20");
  expect(heads.junctionAt({ x: 0, y: 1, reach: 1 })).toBe("10");
  expect(heads.junctionAt({ x: 0, y: 40, reach: 1 })).toBeNull();
  expect(heads.junctions).toEqual(["10", "20"]);
  expect(heads.middle("20")).toEqual({ x: 9, y: 0 });
});
