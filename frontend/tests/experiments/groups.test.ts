import { expect, test } from "vitest";

import type { FigureGroup, StudyInfo } from "../../src/api/studies";
import { matters, meanWord, outcomeWord, rounded } from "../../src/experiments/groups";

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
