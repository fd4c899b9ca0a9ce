import { expect, test } from "vitest";

import type { FigureGroup, StudyInfo } from "../../src/api/studies";
import {
  differenceWords,
  inReadersUnits,
  matters,
  meanWord,
  outcomeWord,
  rounded,
} from "../../src/experiments/groups";

const GROUP: FigureGroup = {
  scenario: "a",
  variant: "as-designed",
  runs: 3,
  mean: 12.3456,
  half_width: 0.3142,
  values: [12.1, 12.4, 12.5],
};

test("a mean has the digits that its interval knows", () => {
  expect(meanWord(GROUP)).toBe("12.35 ± 0.31");
  expect(meanWord({ ...GROUP, mean: -1234.5, half_width: 80 })).toBe("−1,235 ± 80");
  expect(meanWord({ ...GROUP, mean: null, half_width: null, values: [7.25] })).toBe("7.3");
  expect(meanWord({ ...GROUP, mean: null, half_width: null, values: [] })).toBe("–");
  expect(meanWord({ ...GROUP, mean: 0, half_width: 0 })).toBe("0.0 ± 0.0");
  expect(rounded(0.00123)).toBe("0.0012");
});

test("a difference matters if its interval does not reach zero", () => {
  expect(matters({ ...GROUP, mean: -0.5, half_width: 0.4 })).toBe(true);
  expect(matters({ ...GROUP, mean: 0.5, half_width: 0.5 })).toBe(false);
  expect(matters({ ...GROUP, mean: null, half_width: null })).toBe(false);
});

test("a study says how far it is", () => {
  const info = { state: "running", runs: 2000, ended: 12, completed: 12 } as StudyInfo;
  expect(outcomeWord(info)).toBe("running, 12 of 2,000 runs");
  expect(outcomeWord({ ...info, state: "done", ended: 2000, completed: 2000 })).toBe("all runs completed");
  expect(outcomeWord({ ...info, state: "done", ended: 2000, completed: 1998 })).toBe(
    "2 of 2,000 runs failed",
  );
});

const SPEED = { name: "mean_speed", label: "mean speed", unit: "m/s", better: "higher" as const };
const DELAY = { name: "mean_delay", label: "mean delay", unit: "s", better: "lower" as const };

test("a comparison of two scenarios is one sentence, with its interval and what is better", () => {
  const after = { ...GROUP, scenario: "after", mean: -12, half_width: 4 };
  expect(differenceWords(DELAY, after, "before")).toBe(
    "Mean delay falls by 12.0 s (8.0 to 16.0) in after, compared with before: better.",
  );
  expect(differenceWords(DELAY, { ...after, mean: 3, half_width: 1 }, "before")).toBe(
    "Mean delay rises by 3.0 s (2.0 to 4.0) in after, compared with before: worse.",
  );
  expect(differenceWords(DELAY, { ...after, mean: 1.1, half_width: 3 }, "before")).toBe(
    "Mean delay: no clear difference between after and before (−1.9 to 4.1 s).",
  );
  expect(differenceWords(DELAY, { ...after, mean: null, half_width: null }, "before")).toBe(
    "Mean delay: two runs of each are needed to compare after with before.",
  );
});

test("speeds of studies are in the unit of the reader, differences as well", () => {
  const results = { figures: [SPEED], figure: "mean_speed", groups: [GROUP], differences: [], between: [] };
  const after = { ...GROUP, mean: -1, half_width: 0.5, values: [-1, -1.5] };
  const shown = inReadersUnits({ ...results, between: [after] });
  expect(shown.figures[0]?.unit).toBe("km/h");
  expect(shown.groups[0]?.mean).toBeCloseTo(44.44, 2);
  expect([shown.between[0]?.mean, shown.between[0]?.half_width]).toEqual([-3.6, 1.8]);
  expect(shown.between[0]?.values).toEqual([-3.6, -5.4]);
});
