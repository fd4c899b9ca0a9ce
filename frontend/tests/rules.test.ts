import { expect, test } from "vitest";

import { type Draft, draftOf, missing, readPlace, type Rule, ruleOf, sentence } from "../src/editor/rules";

const draft = (fields: Partial<Draft>): Draft => ({
  id: "rule-1",
  actor: "van-1",
  join: "all",
  conditions: [{ kind: "ttc", values: { to: "ego", below: 3 } }],
  delay: 0,
  actions: [{ kind: "lane", values: { by: 1, over: 3 } }],
  times: 1,
  ...fields,
});

/** A rule as the server sends it. */
const sent = (when: object, then: object[]): Rule =>
  ({
    id: "rule-1",
    actor: "van-1",
    when: { delay: 0, edge: "none", ...when },
    then,
    times: 1,
  }) as unknown as Rule;

test("a rule is a sentence with units", () => {
  expect(sentence(draft({}))).toBe(
    "When time to collision with ego is below 3 s, change 1 lane to the left over 3 s.",
  );
  expect(
    sentence(
      draft({
        join: "any",
        conditions: [
          { kind: "speed", values: { above: 10 } },
          { kind: "distance", values: { of: "ego", place: [1, 2.5], below: 20, along: "lane" } },
        ],
        delay: 1.5,
        actions: [
          { kind: "brake", values: { by: 6, hold: 2 } },
          { kind: "speed", values: { to: 20, rate: 2 } },
        ],
        times: 2,
      }),
    ),
  ).toBe(
    "When speed of van-1 is above 36 km/h or distance of ego to 1, 2.5 along the lane is below 20 m, " +
      "1.5 s later, brake at 6 m/s² to a standstill and drive on after 2 s, " +
      "then reach 72 km/h at 2 m/s², up to 2 times.",
  );
});

test("a rule that the form knows goes through it without a change", () => {
  const rule = sent({ time: { after: 4 }, delay: 1 }, [{ cut_in: { to: "ego", gap: null, over: 2 } }]);
  const known = draftOf(rule);
  expect(known && ruleOf(known)).toEqual({
    id: "rule-1",
    actor: "van-1",
    when: { time: { after: 4 }, delay: 1 },
    then: [{ cut_in: { to: "ego", over: 2 } }],
    times: 1,
  });
});

test("a rule with something that the form does not know has no form", () => {
  const brake = { brake: { by: 6, hold: null } };
  const time = { time: { after: 4 } };
  expect(draftOf(sent(time, [brake]))).not.toBeNull();
  expect(draftOf(sent({ touched: { of: null, to: null } }, [brake]))).toBeNull();
  expect(draftOf(sent(time, [{ together: [brake, { horn: {} }] }]))).toBeNull();
  expect(draftOf(sent({ ...time, edge: "rising" }, [brake]))).toBeNull();
  expect(draftOf(sent({ not: { ...time, delay: 0, edge: "none" } }, [brake]))).toBeNull();
  expect(
    draftOf(sent({ distance: { to: "ego", below: 5, along: "straight", free: false } }, [brake])),
  ).toBeNull();
});

test("what is not given yet is named, and a place may be two numbers", () => {
  expect(missing(draft({ actions: [{ kind: "walk", values: { to: "" } }] }))).toEqual(["Place"]);
  expect(missing(draft({}))).toEqual([]);
  expect(readPlace("12.5, -3")).toEqual([12.5, -3]);
  expect(readPlace(" 1.0.-1.3 ")).toBe("1.0.-1.3");
});
