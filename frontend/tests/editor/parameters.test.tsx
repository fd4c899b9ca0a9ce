// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { ScenarioDocument } from "../../src/api/types";
import { boundsFor, nameFor, numbersOf, placeLabel, stepOf, usesOf } from "../../src/editor/parameters";
import { ParametersStep } from "../../src/editor/ParametersStep";
import { actor, flow, scenario } from "../example";
import { choose, fill, show } from "../page";

const gap = { value: 20, unit: "m", min: 5, max: 50, description: "When the van comes over" };
const document: ScenarioDocument = {
  ...scenario([actor("van"), { ...actor("ego"), speed: 12 }], ["a"], [flow("f/1", "1.0.-1.1")]),
  parameters: { gap },
  formulas: { "actors/ego/speed": "$gap - 8" },
};

test("numbers are named by whose they are, as the server names their places", () => {
  const numbers = numbersOf(document);
  const found = new Map(numbers.map(({ place, label, value }) => [place, { label, value }]));
  expect(found.get("actors/van/speed")).toEqual({ label: "van: speed", value: null });
  expect(found.get("actors/ego/lateral_offset")).toEqual({ label: "ego: lateral offset", value: 0.5 });
  expect(found.get("flows/f~11/per_hour")).toEqual({ label: "f/1: per hour", value: 300 });
  expect(found.get("simulation/duration")).toEqual({ label: "Run: duration", value: 60 });
  expect(numbers.some(({ place }) => place.includes("goal"))).toBe(false);
});

test("places, names and bounds are made for people", () => {
  expect(placeLabel("rules/cut-in/when/ttc/below")).toBe("Rule cut-in: when ttc below");
  expect(placeLabel("rules/cut-in/then/0/lane/by")).toBe("Rule cut-in: then 1 lane by");
  expect(nameFor("actors/van-1/speed", [])).toBe("van_1_speed");
  expect(nameFor("actors/van-1/speed", ["van_1_speed"])).toBe("van_1_speed_2");
  expect([boundsFor(12), boundsFor(-4), boundsFor(0)]).toEqual([
    [6, 24],
    [-8, -2],
    [0, 10],
  ]);
  expect([stepOf(5, 50), stepOf(0, 1)]).toEqual([0.1, 0.001]);
  expect(usesOf({ a: "$gap2", "actors/van/speed": "2 * $gap" }, "gap").map(({ place }) => place)).toEqual([
    "actors/van/speed",
  ]);
});

function shown() {
  const calls = { onEdit: vi.fn(), onShow: vi.fn() };
  return { ...show(<ParametersStep name="s" document={document} {...calls} />), ...calls };
}

test("a parameter has a slider between its bounds, and the formulas that use it", async () => {
  const { user, onEdit, onShow } = shown();
  const slider = screen.getByRole("slider", { name: "gap" });
  expect(["aria-valuemin", "aria-valuemax", "aria-valuenow"].map((one) => slider.getAttribute(one))).toEqual([
    "5",
    "50",
    "20",
  ]);
  slider.focus();
  await user.keyboard("{ArrowRight}");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_parameter", parameter: "gap", value: 20.1 });
  await fill(user, "ego: speed", "$gap - 10");
  expect(onEdit).toHaveBeenLastCalledWith({
    kind: "set_formula",
    place: "actors/ego/speed",
    formula: "$gap - 10",
  });
  await user.click(screen.getByRole("button", { name: "Show where ego: speed is" }));
  expect(onShow).toHaveBeenCalledWith({ root: "actors", id: "ego" });
  await user.click(screen.getByRole("button", { name: "Unlink ego: speed" }));
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_formula", place: "actors/ego/speed", formula: null });
  expect(screen.getByRole("link", { name: "Sweep the parameters" }).getAttribute("href")).toBe("#/sweeps/s");
});

test("a number becomes a parameter in one step", async () => {
  const { user, onEdit } = shown();
  await choose(user, "Value to vary", "van: depart, now 0");
  await user.click(screen.getByRole("button", { name: "Add the parameter" }));
  expect(onEdit).toHaveBeenCalledWith(
    [
      { kind: "set_parameter", parameter: "van_depart", value: 0, unit: "", min: 0, max: 10 },
      { kind: "set_formula", place: "actors/van/depart", formula: "$van_depart" },
    ],
    "Parameter van_depart",
  );
  await fill(user, "Name of the parameter", "gap");
  expect(screen.getByText("There is one of that name")).toBeDefined();
});
