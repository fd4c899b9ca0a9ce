import { expect, test } from "vitest";

import { scenarioLabels } from "../../src/catalogue/titles";

test("scenarios of the same title are told apart by their names, others are not burdened", () => {
  const list = [
    { name: "run-1", title: "grid" },
    { name: "run-2", title: "grid" },
    { name: "town-1", title: "A wet evening" },
    { name: "town-2", title: null },
  ];
  expect(scenarioLabels(list)).toEqual(["grid (run-1)", "grid (run-2)", "A wet evening", "town-2"]);
});

test("a title that is also a name of its own stays as it is", () => {
  const list = [
    { name: "grid", title: "grid" },
    { name: "run-1", title: "grid" },
  ];
  expect(scenarioLabels(list)).toEqual(["grid", "grid (run-1)"]);
});
