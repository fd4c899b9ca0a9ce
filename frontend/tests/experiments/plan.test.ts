import { expect, test } from "vitest";

import type { SweepCase } from "../../src/api/sweeps";
import {
  countOf,
  faultOf,
  lasting,
  likelyBefore,
  marksOf,
  newForm,
  setOf,
  sorted,
  type SweepForm,
  verdictOf,
  wishOf,
} from "../../src/experiments/plan";

const parameter = (value: number, min: number | null = null, max: number | null = null) => ({
  value,
  unit: "",
  min,
  max,
  description: "",
});
const form = (): SweepForm =>
  newForm({
    parameters: { gap: parameter(20, 5, 50), speed: parameter(10), half: parameter(10, 0, 30) },
    formulas: { "parameters/half/value": "$gap / 2" },
  });
const varied = (fields: Partial<SweepForm["varied"][string]>, name = "gap"): SweepForm => {
  const made = form();
  const one = made.varied[name];
  if (!one) throw new Error(name);
  return { ...made, varied: { ...made.varied, [name]: { ...one, ...fields } } };
};
const one = (name: string, safe: boolean | null, value: number, ttc: number | null): SweepCase => ({
  case: name,
  status: safe === null ? "refused" : "completed",
  safe,
  detail: null,
  values: [value],
  measures: [ttc],
});
const COLUMNS = [{ name: "min_ttc", unit: "s" }];

test("parameters with bounds of their own are varied between them, computed ones are not", () => {
  const { varied: found } = form();
  expect(found["gap"]).toMatchObject({ how: "range", low: 5, high: 50, steps: 5 });
  expect([found["speed"]?.how, found["half"]?.how]).toEqual(["fixed", "fixed"]);
  expect(faultOf(form())).toBeNull();
});

test("values that belong together are typed or pasted, and multiply what is varied alone", () => {
  const typed = {
    ...varied({ how: "range", low: 5, high: 50, steps: 4 }),
    table: "speed\thalf\n10\t3\n 12.5, 4 \n\n",
  };
  expect(faultOf(typed)).toBeNull();
  expect(countOf(typed)).toBe(4 * 2);
  expect(wishOf("s", typed).vary).toEqual([
    { parameter: "gap", low: 5, high: 50, steps: 4 },
    {
      parameters: ["speed", "half"],
      table: [
        [10, 3],
        [12.5, 4],
      ],
    },
  ]);
});

test("a parameter in the table is varied there alone", () => {
  const typed = { ...form(), table: "gap speed\n6 10\n7 11\n8 12" };
  expect(countOf(typed)).toBe(3);
  expect(wishOf("s", typed).vary).toHaveLength(1);
  expect(countOf({ ...typed, method: "sobol", samples: 7 })).toBe(7);
});

test.each([
  ["gap fog\n1 2", "Table: there is no parameter fog that could be varied."],
  ["gap gap\n1 2", "Table: gap is there twice."],
  ["gap speed", "Table: write values below the names."],
  ["gap speed\n6 10\n7", "Table: row 2 needs 2 numbers."],
  ["gap\nsix", "Table: row 1 needs 1 number."],
])("a table that cannot be is refused with its place", (table, said) => {
  expect(faultOf({ ...form(), table })).toBe(said);
});

test("limits of a safe case are those of the form, and odd ones are told", () => {
  const limited = { ...form(), ttc: null, pet: 1.5, drac: 3, limits: ["mean_speed >= 8"] };
  expect(wishOf("s", limited).safe).toEqual(["min_pet >= 1.5", "max_drac <= 3", "mean_speed >= 8"]);
  expect(faultOf(limited)).toBeNull();
  expect(faultOf({ ...limited, limits: ["fast"] })).toBe(
    "fast: write a column, >=, <=, > or <, and a number.",
  );
});

test("a grid has all combinations, samples as many as are asked for", () => {
  const both = { ...form().varied, ...varied({ how: "set", values: "10, 12.5; 20" }, "speed").varied };
  expect(countOf({ ...form(), varied: both })).toBe(15);
  expect(countOf({ ...form(), varied: both, method: "sobol", samples: 40 })).toBe(40);
});

test("a form becomes what the server takes: steps on a grid, a number and a seed of samples", () => {
  expect(wishOf("s", varied({ steps: 9 }))).toEqual({
    scenario: "s",
    vary: [{ parameter: "gap", low: 5, high: 50, steps: 9 }],
    method: "grid",
    safe: ["min_ttc >= 1"],
    figures: [],
    seed: null,
    processes: 2,
  });
  const sampled = wishOf("s", { ...form(), method: "latin", samples: 12, sampleSeed: 3, ttc: null, seed: 4 });
  expect(sampled).toMatchObject({ method: "latin", samples: 12, sample_seed: 3, safe: [], seed: 4 });
  expect(sampled.vary).toEqual([{ parameter: "gap", low: 5, high: 50 }]);
});

test("what cannot be swept is said before it is sent", () => {
  expect(faultOf(varied({ how: "fixed" }))).toBe("Vary at least one parameter.");
  expect(faultOf(varied({ low: 50 }))).toBe("gap: the range must end above its begin.");
  expect(faultOf(varied({ how: "set", values: "1, two" }))).toBe("gap: write numbers between commas.");
  expect([setOf("1, 2;3 4"), setOf(""), setOf("1, x")]).toEqual([[1, 2, 3, 4], null, null]);
});

test("cases are sorted by any column, and those without a value come last both ways", () => {
  const cases = [one("case-001", true, 3, null), one("case-002", false, 2, 0.4), one("case-003", null, 1, 2)];
  const names = (column: Parameters<typeof sorted>[1], down: boolean) =>
    sorted(cases, column, down).map((each) => each.case.at(-1));
  expect(names({ kind: "value", at: 0 }, false)).toEqual(["3", "2", "1"]);
  expect(names({ kind: "measure", at: 0 }, false)).toEqual(["2", "3", "1"]);
  expect(names({ kind: "measure", at: 0 }, true)).toEqual(["3", "2", "1"]);
  expect(names({ kind: "safe" }, true)).toEqual(["1", "2", "3"]);
});

test("a safe case without an encounter is told apart", () => {
  const verdicts = [
    one("a", true, 1, null),
    one("a", true, 1, 2),
    one("a", false, 1, 0),
    one("a", null, 1, 1),
  ];
  expect(verdicts.map((each) => verdictOf(each, COLUMNS))).toEqual(["calm", "safe", "unsafe", "other"]);
});

test("marks are round numbers inside the range, and times are in words", () => {
  expect(marksOf(0.3, 4.1)).toEqual([1, 2, 3, 4]);
  expect(marksOf(-5, 52)).toEqual([0, 10, 20, 30, 40, 50]);
  expect([lasting(0.2), lasting(75), lasting(600), lasting(9000)]).toEqual([
    "1 s",
    "75 s",
    "10 min",
    "2.5 h",
  ]);
});

test("a scenario is compared with the one it is a copy of, or with the only other one", () => {
  expect(likelyBefore("peak-copy", ["other", "peak"])).toBe("peak");
  expect(likelyBefore("peak-copy-copy", ["peak", "peak-copy"])).toBe("peak-copy");
  expect(likelyBefore("peak", ["other"])).toBe("other");
  expect(likelyBefore("peak", ["one", "two"])).toBeNull();
});
