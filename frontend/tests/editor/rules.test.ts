import { expect, test } from "vitest";

import { actionKind, canDo } from "../../src/editor/rules/actionKinds";
import {
  actionsFor,
  type Draft,
  draftOf,
  missing,
  newDraft,
  newItem,
  readPlace,
  type Rule,
  ruleOf,
  rulesOf,
  sentence,
  settled,
} from "../../src/editor/rules/draft";
import { placeWord } from "../../src/editor/placeWords";
import { namePlaces } from "../../src/editor/rules/fields";
import { ruleShapes } from "../../src/editor/rules/ruleShapes";
import { Graph } from "../../src/map/graph";
import { columns } from "../example";

const NOW = { delay: 0, edge: "none" } as const;

const draft = (fields: Partial<Draft>): Draft => ({
  id: "rule-1",
  actor: "van-1",
  when: { kind: "ttc", values: { to: "ego", below: 3 }, ...NOW },
  then: [[{ kind: "lane", values: { by: 1, over: 3 } }]],
  times: 1,
  ...fields,
});

/** A rule as the server sends it. */
const sent = (when: object, then: object[], times = 1): Rule =>
  ({ id: "rule-1", actor: "van-1", when: { ...NOW, ...when }, then, times }) as unknown as Rule;

const time = { time: { after: 4 }, ...NOW };
const brake = { brake: { by: 6, hold: null } };

test("a rule is a sentence with units", () => {
  expect(sentence(draft({}))).toBe(
    "When time to collision with ego is below 3 s, change 1 lane to the left over 3 s.",
  );
  const speed = { kind: "speed", values: { above: 10 }, ...NOW };
  const near = { kind: "distance", values: { of: "ego", place: [1, 2.5], below: 20, along: "lane" }, ...NOW };
  expect(
    sentence(
      draft({
        when: { join: "any", of: [speed, near], delay: 1.5, edge: "none" },
        then: [
          [{ kind: "brake", values: { by: 6, hold: 2 } }],
          [{ kind: "speed", values: { to: 20, rate: 2 } }],
        ],
        times: 2,
      }),
    ),
  ).toBe(
    "When speed of van-1 is above 36 km/h or distance of ego to x 1 m, y 2.5 m along the lane is below 20 m, " +
      "1.5 s later, brake at 6 m/s² to a standstill and drive on after 2 s, " +
      "then reach 72 km/h at 2 m/s², up to 2 times.",
  );
});

test("combinations, edges and actions at the same time are said in the sentence", () => {
  const nested = sent(
    {
      all: [
        { not: time, ...NOW },
        { any: [time, { ...time, delay: 2 }], ...NOW },
      ],
    },
    [{ together: [brake, { horn: {} }] }, { signal: { light: "9", shows: "off" } }],
  );
  expect(sentence(draftOf(nested))).toBe(
    "When not (time is 4 s or more) and (time is 4 s or more or time is 4 s or more (2 s later)), " +
      "brake at 6 m/s² to a standstill and at the same time sound the horn, then switch the light at Junction 9 off.",
  );
  expect(sentence(draftOf(sent({ ...time, edge: "rising" }, [brake])))).toMatch(
    /^When it becomes true that time is 4 s or more, /,
  );
});

/** What is not given is left out when a rule is sent. */
const bare = (value: unknown): unknown => {
  if (Array.isArray(value)) return value.map(bare);
  if (typeof value !== "object" || value === null) return value;
  const kept = Object.entries(value).filter(
    ([name, one]) => one !== null && !(name === "delay" && one === 0) && !(name === "edge" && one === "none"),
  );
  return Object.fromEntries(kept.map(([name, one]) => [name, bare(one)]));
};

test.each<[string, Rule]>([
  [
    "a combination in combinations",
    sent({ any: [{ not: { all: [time, time], ...NOW }, delay: 3, edge: "rising" }, time] }, [brake]),
  ],
  ["actions at the same time", sent(time, [{ together: [brake, { horn: {} }] }, brake], 5)],
  ["one condition in a list", sent({ all: [{ ...time, delay: 1 }], delay: 2 }, [brake])],
  [
    "centres instead of bodies",
    sent({ distance: { to: "ego", below: 5, along: "straight", free: false } }, [brake]),
  ],
  [
    "a path with times",
    sent(time, [{ path: { points: [[1, 2], "1.0.-1.3"], speeds: [], times: [1.5, 3] } }]),
  ],
  [
    "a trajectory",
    sent(time, [
      {
        replay: {
          rows: [
            [0, 1, 2, 0],
            [1, 3, 2, 0.1],
          ],
        },
      },
    ]),
  ],
  ["lights", sent({ touched: { of: null, to: null } }, [{ lights: { indicator: "left", brake: false } }])],
  ["a walk through others", sent(time, [{ walk: { to: "ped.1.0.2.3", through: [[4, 5]], speed: 1.4 } }])],
])("%s go through the form without a change", (_, rule) => {
  expect(ruleOf(draftOf(rule))).toEqual(bare(rule));
});

test("fields without meaning are left out, and are there again when they have one", () => {
  const known = actionKind("speed");
  const step = settled(known, { to: 5, shape: "step", rate: 2 }, []);
  expect(step).toEqual({ to: 5, shape: "step" });
  expect(settled(known, { ...step, shape: "cosine" }, [])).toEqual({ to: 5, shape: "cosine", rate: 2 });
  expect(settled(actionKind("signal"), { light: "9", shows: "off", movement: "a>b" }, [])).toEqual({
    light: "9",
    shows: "off",
  });
});

test("what is not given yet is named, and a place may be two numbers", () => {
  expect(missing(draft({ id: " ", then: [[{ kind: "walk", values: { to: "" } }]] }))).toEqual([
    "Name",
    "Place",
  ]);
  expect(missing(draft({ then: [[newItem("path", actionKind("path"), [])]] }))).toEqual(["Points"]);
  expect(missing(draft({ then: [[newItem("walk", actionKind("walk"), [])]] }))).toEqual(["Place"]);
  expect(missing(draft({}))).toEqual([]);
  expect(readPlace("12.5, -3")).toEqual([12.5, -3]);
  expect(readPlace(" 1.0.-1.3 ")).toBe("1.0.-1.3");
});

test("where a rule acts is drawn: its trigger as a circle, its path from where the road user starts", () => {
  const graph = new Graph(columns);
  const start = graph.vehiclePlace(0);
  const actors = [{ id: "van-1", spawn: start.id }] as never;
  const rule = sent({ reaches: { place: [10, 20], within: 5 } }, [
    {
      path: {
        points: [
          [1, 2],
          [3, 4],
        ],
      },
    },
  ]);
  const { pins, lines } = ruleShapes(graph, { rules: [rule], actors }, null);
  expect(pins.map(({ x, y, text }) => [x, y, text])).toEqual([[10, 20, "rule-1: when"]]);
  expect(lines[0]?.points[0]).toEqual([15, 20]);
  expect(lines[1]).toEqual({
    points: [
      [start.x, start.y],
      [1, 2],
      [3, 4],
    ],
    strong: true,
    arrow: true,
  });
  const other = draft({ id: "rule-2" });
  expect(ruleShapes(graph, { rules: [rule], actors }, other).lines.map(({ strong }) => strong)).toEqual([
    false,
    false,
  ]);
});

test("road users are offered what they can do, and a new rule begins with that", () => {
  expect(["cut_in", "lane", "walk", "brake"].map((kind) => canDo(kind, true))).toEqual([
    false,
    false,
    true,
    true,
  ]);
  expect(["cut_in", "lane", "walk", "brake"].map((kind) => canDo(kind, false))).toEqual([
    true,
    true,
    false,
    true,
  ]);
  const walker = newDraft(["car-1", "pedestrian-1"], [], ["pedestrian-1"]);
  expect([walker.actor, walker.when, walker.then[0]?.[0]?.kind]).toMatchObject([
    "pedestrian-1",
    { kind: "distance" },
    "walk",
  ]);
  const van = newDraft(["car-1", "van-1"], []);
  expect(actionsFor(van.then, true, ["car-1"])[0]?.[0]?.kind).toBe("walk");
  expect(actionsFor(van.then, false, ["car-1"])).toEqual(van.then);
});

test("a pedestrian waits until 30 m, by a rule of its own; who has no rule yet comes first", () => {
  const rule = { actor: "van-1" } as Rule;
  const walker = newDraft(["car-1", "van-1", "pedestrian-1"], [rule], ["pedestrian-1"]);
  expect(walker).toMatchObject({ actor: "pedestrian-1", when: { values: { below: 30 } }, waits: true });
  const [wait, walk] = rulesOf(walker, ["pedestrian-1"], ["rule-1-wait"]);
  expect(wait).toMatchObject({
    id: "rule-1-wait+",
    actor: "pedestrian-1",
    when: { time: { after: 0 } },
    then: [{ stop: {} }],
  });
  expect(walk).toEqual(ruleOf(walker));
  expect(walk).not.toHaveProperty("waits");
  expect(rulesOf({ ...walker, waits: false }, ["pedestrian-1"], [])).toEqual([walk]);
  expect(rulesOf(walker, [], [])).toEqual([walk]); // a rule moves the pedestrian already
  const van = newDraft(["car-1", "van-1"], []);
  expect(rulesOf(van, ["pedestrian-1"], [])).toEqual([ruleOf(van)]);
});

test("a node is said as a place once the map is there", () => {
  const graph = new Graph(columns);
  const node = "1.0.-1.0";
  const walks = draft({ then: [[{ kind: "walk", values: { to: node } }]] });
  expect(sentence(walks)).toContain(`walk to ${node}.`);
  namePlaces((id) => placeWord(graph, id));
  expect(sentence(walks)).toContain(`walk to ${placeWord(graph, node)}.`);
  expect(sentence(walks)).toContain("time to collision with ego is below 3 s");
  namePlaces((id) => id);
});
