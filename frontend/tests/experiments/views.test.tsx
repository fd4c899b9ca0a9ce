// @vitest-environment happy-dom
import { screen, waitFor, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import {
  type PlannedSweep,
  type SweepCase,
  type SweepCases,
  type SweepInfo,
  sweeps,
} from "../../src/api/sweeps";
import type { ScenarioDocument } from "../../src/api/types";
import { prefer } from "../../src/language/preferences";
import { CaseTable } from "../../src/experiments/CaseTable";
import { costOf, PlanForm } from "../../src/experiments/PlanForm";
import { Parallel } from "../../src/experiments/Parallel";
import { Plane } from "../../src/experiments/Plane";
import { SweepView } from "../../src/experiments/SweepView";
import { actor, scenario } from "../example";
import { rowsOf, server, show } from "../page";

const one = (
  name: string,
  safe: boolean | null,
  values: number[],
  measures: (number | null)[],
): SweepCase => ({ case: name, status: "completed", safe, detail: null, values, measures });
const table: SweepCases = {
  sweep: "s-1",
  limits: ["no collision", "min_ttc >= 1"],
  parameters: [
    { name: "gap", unit: "m" },
    { name: "speed", unit: "m/s" },
  ],
  columns: [
    { name: "collision", unit: "" },
    { name: "min_ttc", unit: "s" },
    { name: "min_pet", unit: "s" },
  ],
  cases: [
    one("case-001", false, [10, 12], [1, 0.2, null]),
    one("case-002", true, [10, 26], [0, null, null]),
    one("case-003", true, [40, 12], [0, 1.23456, null]),
    { ...one("case-004", null, [40, 26], [null, null, null]), status: "refused", detail: "too far" },
  ],
  boundary: [
    [
      [25, 12],
      [10, 19],
    ],
  ],
};
const planned = {
  cases: 25,
  tried: "case-013",
  case_seconds: 2,
  without_effect: [],
  seconds: 25,
  disk: 5e6,
  free: 1e9,
  processes: 2,
  patience: 60,
};
const INSTALLED = [
  { name: "top_speed", definition: "Highest speed.", error: "" },
  { name: "gone", definition: "", error: "it cannot be imported" },
];
const info: SweepInfo = {
  sweep: "s-1",
  scenario: "s",
  state: "done",
  parameters: ["gap", "speed"],
  method: "grid",
  cases: 4,
  ended: 3,
  seconds_left: null,
  safe: 2,
  unsafe: 1,
  error: null,
  changed: 0,
};

test("the table has the columns that some case has, sorts by them, and opens a case", async () => {
  const onOpen = vi.fn();
  const { user } = show(<CaseTable table={table} onOpen={onOpen} />);
  const cases = screen.getByRole("table", { name: "Cases of the sweep" });
  expect(rowsOf(cases)).toEqual([
    ["case-001", "not safe", "10", "12", "yes", "0.2"],
    ["case-002", "safe, no encounter", "10", "26", "no", ""],
    ["case-003", "safe", "40", "12", "no", "1.235"],
    ["case-004", "refusedtoo far", "40", "26", "", ""],
  ]);
  const order = (): (string | undefined)[] => rowsOf(cases).map(([name]) => name?.at(-1));
  const head = within(cases).getByRole("button", { name: /^min_ttc, s/ });
  await user.click(head);
  expect(order()).toEqual(["1", "3", "2", "4"]);
  await user.click(head);
  expect(order()).toEqual(["3", "1", "2", "4"]);
  expect(
    within(cases)
      .getByRole("columnheader", { name: /^min_ttc/ })
      .getAttribute("aria-sort"),
  ).toBe("descending");
  await user.click(screen.getByRole("button", { name: "Open case-003 in the editor" }));
  expect(onOpen).toHaveBeenCalledWith("case-003");
  expect(
    screen.getByRole<HTMLButtonElement>("button", { name: "Open case-004 in the editor" }).disabled,
  ).toBe(true);
});

test("the plane has a dot for each case and the boundary; a click on a dot opens its case", async () => {
  const onOpen = vi.fn();
  const { user } = show(<Plane table={table} onOpen={onOpen} />);
  const dots = [...document.querySelectorAll<SVGCircleElement>(".plane-dot")];
  expect(dots.map((dot) => [dot.dataset["case"], dot.dataset["verdict"]]).sort()).toEqual([
    ["case-001", "unsafe"],
    ["case-002", "calm"],
    ["case-003", "safe"],
    ["case-004", "other"],
  ]);
  expect(document.querySelectorAll(".plane-boundary")).toHaveLength(1);
  for (const dot of dots) await user.click(dot);
  expect(onOpen.mock.calls.flat().sort()).toEqual(["case-001", "case-002", "case-003"]);
});

test("each case is a line across its parameters and measures; a click on it opens the case", async () => {
  const onOpen = vi.fn();
  const { user } = show(<Parallel table={table} onOpen={onOpen} />);
  const lines = [...document.querySelectorAll<SVGPathElement>(".parallel-line")];
  const parts = lines.map((line) => [
    line.dataset["case"],
    (line.getAttribute("d") ?? "").split(/[ML]/).length - 1,
  ]);
  // gap, speed and min_ttc; no case has a min_pet
  expect(parts.sort()).toEqual([
    ["case-001", 3],
    ["case-002", 2],
    ["case-003", 3],
    ["case-004", 2],
  ]);
  for (const line of lines) await user.click(line);
  expect(onOpen.mock.calls.flat().sort()).toEqual(["case-001", "case-002", "case-003"]);
});

test("a sweep tells what it takes before it starts, and a change of the form asks anew", async () => {
  const swept: ScenarioDocument = {
    ...scenario([actor("a")]),
    parameters: { gap: { value: 20, unit: "m", min: 5, max: 50, description: "" } },
  };
  const asked = server({ "/api/figures": [], "/api/sweeps/plan": planned, "/api/sweeps": info });
  const { user } = show(<PlanForm scenario="s" document={swept} />);
  expect(screen.getByText("5 cases, each a run of 60 s.")).toBeDefined();
  expect(screen.queryByRole("button", { name: /^Run/ })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Plan the sweep" }));
  expect(await screen.findByText(costOf(planned))).toBeDefined();
  expect(costOf(planned)).toContain("took 2.0 s: about 25 s for all, 2 at a time, and 5 MB of disk");
  const values = screen.getByRole("textbox", { name: "Values of gap" });
  await user.clear(values);
  await user.type(values, "7");
  expect(screen.queryByRole("button", { name: /^Run/ })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Plan the sweep" }));
  await user.click(await screen.findByRole("button", { name: "Run 25 cases" }));
  expect(asked.at(-1)).toMatchObject({
    path: "/api/sweeps",
    body: { scenario: "s", vary: [{ parameter: "gap", low: 5, high: 50, steps: 7 }] },
  });
});

test("figures of installed packages are offered as columns, but for those that cannot be used", async () => {
  const swept: ScenarioDocument = {
    ...scenario([actor("a")]),
    parameters: { gap: { value: 20, unit: "m", min: 5, max: 50, description: "" } },
  };
  const asked = server({
    "/api/figures/installed": INSTALLED,
    "/api/figures": [],
    "/api/sweeps/plan": planned,
  });
  const { user } = show(<PlanForm scenario="s" document={swept} />);
  await user.click(screen.getByRole("textbox", { name: "Additional result columns" }));
  await user.click(await screen.findByRole("option", { name: "top_speed" }));
  expect(screen.queryByRole("option", { name: "gone" })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Plan the sweep" }));
  expect(await screen.findByText(costOf(planned))).toBeDefined();
  expect(asked.at(-1)).toMatchObject({ body: { figures: ["top_speed"] } });
});

test("what a sweep takes is not said of a form that has changed while it was found out", async () => {
  const swept: ScenarioDocument = {
    ...scenario([actor("a")]),
    parameters: { gap: { value: 20, unit: "m", min: 5, max: 50, description: "" } },
  };
  let answer: (found: PlannedSweep) => void = () => undefined;
  const plan = vi.spyOn(sweeps, "plan").mockReturnValue(new Promise((done) => (answer = done)));
  server({ "/api/figures": [] });
  const { user } = show(<PlanForm scenario="s" document={swept} />);
  await user.click(screen.getByRole("button", { name: "Plan the sweep" }));
  await user.type(screen.getByRole("textbox", { name: "Values of gap" }), "0");
  expect(screen.getByText("50 cases, each a run of 60 s.")).toBeDefined();
  answer(planned);
  await waitFor(() =>
    expect(screen.getByRole("button", { name: "Plan the sweep" })).toHaveProperty("disabled", false),
  );
  expect(screen.queryByRole("button", { name: /^Run/ })).toBeNull();
  expect(screen.queryByText(costOf(planned))).toBeNull();
  plan.mockRestore();
});

test("a sweep that was stopped says so and can be resumed", async () => {
  const stopped = { ...info, state: "stopped", safe: null, unsafe: null };
  const asked = server({ "/cases": table, "/resume": info, "/api/sweeps/s-1": stopped });
  const { user } = show(<SweepView scenario="s" sweep="s-1" />);
  expect(await screen.findByText(/4 cases of gap, speed: 3 have ended. It was stopped/)).toBeDefined();
  await user.click(screen.getByRole("button", { name: "Resume" }));
  expect(asked.some(({ path }) => path === "/api/sweeps/s-1/resume")).toBe(true);
});

test("ranges and values of a sweep are in the reader's unit, and sent in the parameter's own", async () => {
  prefer({ length: "ft" });
  const swept: ScenarioDocument = {
    ...scenario([actor("a")]),
    parameters: { gap: { value: 6.096, unit: "m", min: 3.048, max: 30.48, description: "" } },
  };
  const asked = server({ "/api/figures": [], "/api/sweeps/plan": planned });
  const { user } = show(<PlanForm scenario="s" document={swept} />);
  expect(screen.getByText("now 20 ft")).toBeDefined();
  expect(screen.getByRole("textbox", { name: "From of gap" })).toHaveProperty("value", "10 ft");
  await user.click(screen.getByText("Set"));
  const values = screen.getByRole("textbox", { name: "Values of gap" });
  await user.clear(values);
  await user.type(values, "10, 100");
  await user.click(screen.getByRole("button", { name: "Plan the sweep" }));
  await waitFor(() => expect(asked.some(({ path }) => path === "/api/sweeps/plan")).toBe(true));
  const sent = asked.find(({ path }) => path === "/api/sweeps/plan")?.body as { vary: unknown[] };
  expect(sent.vary).toEqual([{ parameter: "gap", values: [3.048, 30.48] }]);
  prefer({ length: "m" });
});
