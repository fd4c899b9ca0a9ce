import { expect, test } from "vitest";

import type { ScenarioDocument } from "../../src/api/types";
import { type Block, blocksOf, editOf, moved, wordsOf } from "../../src/time/blocks";
import { actor, flow, scenario } from "../example";

const CLOSURE: ScenarioDocument["measures"][number] = {
  kind: "closure",
  destinations: "leave",
  id: "shut",
  begin: 10,
  end: null,
  places: ["r1"],
};
const condition = (given: object): ScenarioDocument["rules"][number]["when"] =>
  ({ delay: 0, edge: "none", ...given }) as ScenarioDocument["rules"][number]["when"];
const rule = (id: string, when: object): ScenarioDocument["rules"][number] => ({
  id,
  actor: "a",
  when: condition(when),
  then: [{ brake: { by: 4, hold: 2 } } as ScenarioDocument["rules"][number]["then"][number]],
  times: 1,
});
const RULES = [
  rule("plain", { time: { after: 4 } }),
  rule("near", { ttc: { to: "b", below: 3 } }),
  rule("both", {
    all: [condition({ ttc: { to: "b", below: 3 } }), condition({ time: { after: 9 } })],
  }),
];
const document: ScenarioDocument = {
  ...scenario(
    [
      { ...actor("a"), depart: 3 },
      { ...actor("e"), ego: true },
    ],
    ["r1"],
    [flow("f", "1.0.-1.1")],
  ),
  measures: [CLOSURE],
  rules: RULES,
};
const blocks = blocksOf(document, new Map([["a", 37]]));
const block = (id: string): Block => {
  const found = blocks.find((one) => one.id === id);
  if (!found) throw new Error(`no block ${id}`);
  return found;
};

test("what has a time is a block: rules that wait for a time, measures, flows, the ego, the others", () => {
  expect(blocks.map(({ kind, id, begin, until }) => [kind, id, begin, until])).toEqual([
    ["rule", "plain", 4, 4],
    ["rule", "both", 9, 9],
    ["measure", "shut", 10, document.simulation.duration],
    ["flow", "f", 0, 3600],
    ["actor", "e", 0, 0],
    ["actor", "a", 3, 40],
  ]);
});

test("a block moves as a whole, or by one of its ends, between the begin and the end of the run", () => {
  expect(moved(block("a"), "all", 4.25, 600)).toEqual({ begin: 7.25, end: null });
  expect(moved(block("a"), "all", -50, 600)).toEqual({ begin: 0, end: null });
  expect(moved(block("a"), "all", 5000, 600)).toEqual({ begin: 600, end: null });
  const flowing = { begin: 10, end: 60 };
  expect(moved(flowing, "all", 5, 600)).toEqual({ begin: 15, end: 65 });
  expect(moved(flowing, "begin", 100, 600)).toEqual({ begin: 59.9, end: 60 });
  expect(moved(flowing, "end", -100, 600)).toEqual({ begin: 10, end: 10.1 });
  expect(moved(flowing, "end", 1000, 600)).toEqual({ begin: 10, end: 600 });
  // What lasts to the end gets an end only where that is dragged.
  expect(moved(CLOSURE, "all", 5, 600)).toEqual({ begin: 15, end: null });
  expect(moved(CLOSURE, "end", -100, 600)).toEqual({ begin: 10, end: 500 });
});

test("each block has the edit that gives it its times", () => {
  expect(editOf(document, block("a"), { begin: 8, end: null })).toEqual({
    edit: { kind: "change_actor", actor: "a", depart: 8 },
    label: "Departure of a",
  });
  expect(editOf(document, block("f"), { begin: 5, end: 900 })?.edit).toEqual({
    kind: "change_flow",
    flow: "f",
    begin: 5,
    end: 900,
  });
  expect(editOf(document, block("shut"), { begin: 20, end: 50 })?.edit).toEqual({
    kind: "set_measure",
    measure: { ...CLOSURE, begin: 20, end: 50 },
  });
  const changed = editOf(document, block("both"), { begin: 12, end: null })?.edit;
  if (changed?.kind !== "set_rule") throw new Error("no rule");
  expect(changed.rule.when.all).toEqual([{ ttc: { to: "b", below: 3 } }, { time: { after: 12 } }]);
});

test("a block says when it is", () => {
  expect(wordsOf(block("plain"), { begin: 4, end: null }, 4)).toBe("after 0:04.0");
  expect(wordsOf(block("shut"), CLOSURE, 600)).toBe("0:10.0 to the end");
  expect(wordsOf(block("a"), { begin: 3, end: null }, 40)).toBe("departs 0:03.0, planned to arrive 0:40.0");
});
