// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { DetectorLane, GroupPair } from "../../src/api/signals";
import { DayBar } from "../../src/signals/DayBar";
import { clockOf, secondsOf, spansOf, switchesOf, withTimes } from "../../src/signals/day";
import type { SignalEditing, Timing } from "../../src/signals/editing";
import { conflictWords, withGreen } from "../../src/signals/greens";
import { IntergreenMatrix } from "../../src/signals/IntergreenMatrix";
import { loopAt, nearest } from "../../src/signals/laneLines";
import { loggedPlans, planAt, plannedPlans } from "../../src/time/plans";
import { show } from "../page";
import { plan, program } from "./program";

const stage = (id: string, free: string[], permissive: string[] = []): Timing["stages"][number] => ({
  id,
  protected: free,
  permissive,
  green: 10,
  min_green: null,
  max_green: null,
  on_call: false,
});
const pair = (ending: string, beginning: string, more: Partial<GroupPair> = {}): GroupPair => ({
  ending,
  beginning,
  needed: 5,
  given: null,
  used: 5,
  together: "never",
  ...more,
});

test("a green that is never allowed, or has to give way, is said in words", () => {
  const pairs = [pair("K1", "F1"), pair("K1L", "K3", { together: "yields" })];
  expect(conflictWords(pairs, stage("1", ["F1"]), "K1", "permissive")).toMatch(/^K1 and F1 cross/);
  expect(conflictWords(pairs, stage("1", ["F1"]), "K1", "red")).toBeNull();
  expect(conflictWords(pairs, stage("1", ["K3"]), "K1L", "protected")).toMatch(/K1L has to give way to K3/);
  expect(conflictWords(pairs, stage("1", ["K3"]), "K1L", "permissive")).toBeNull();
  // The other way round: who has to give way is green already.
  expect(conflictWords(pairs, stage("1", ["K1L"]), "K3", "protected")).toMatch(/K1L has to give way to K3/);
  const stages = [stage("1", ["K1"]), stage("2", [], ["K1"])];
  expect(withGreen(stages, "K1", "1", "permissive")).toEqual({ protected: [], permissive: ["1", "2"] });
});

test("times of the day are those of the document, and a plan runs until the next begins", () => {
  expect([secondsOf("06:30"), secondsOf("06:30:15"), clockOf(23_400), clockOf(23_415)]).toEqual([
    23_400,
    23_415,
    "06:30",
    "06:30:15",
  ]);
  const plans = [
    { id: "A", times: ["06:00"] },
    { id: "B", times: ["09:00"] },
  ] as Timing["plans"];
  const [first] = plans;
  expect(spansOf(switchesOf(plans))).toEqual([
    { begin: 0, end: 21_600, plan: "B" },
    { begin: 21_600, end: 32_400, plan: "A" },
    { begin: 32_400, end: 86_400, plan: "B" },
  ]);
  if (!first) throw new Error("no plan");
  expect(withTimes("10", first, { without: 21_600, also: 25_200 })).toEqual({
    kind: "set_plan",
    junction: "10",
    plan: "A",
    times: ["07:00"],
  });
});

test("the begin of a plan is moved by keys, not beyond the next one, and goes back if refused", async () => {
  const onMove = vi.fn(() => Promise.resolve(false));
  const switches = [
    { time: 6 * 3600, plan: "A" },
    { time: 7 * 3600, plan: "B" },
  ];
  const { user } = show(<DayBar switches={switches} plans={["A", "B"]} onMove={onMove} />);
  const begin = screen.getByRole("slider", { name: "Begin of plan A" });
  begin.focus();
  await user.keyboard("{PageUp}{Enter}");
  expect(onMove).toHaveBeenLastCalledWith(switches[0], 6.75 * 3600);
  await vi.waitFor(() => expect(begin.getAttribute("aria-valuetext")).toBe("06:00"));
  await user.keyboard("{ArrowLeft}{Escape}");
  expect(onMove).toHaveBeenCalledTimes(1);
});

test("an intergreen is set, taken back to the computed one, and a shorter one is flagged", async () => {
  const attempt = vi.fn((): Promise<string | null> => Promise.resolve(null));
  const light = program({
    pairs: [pair("K1", "K2", { given: 7, used: 7 }), pair("K2", "K1", { given: 3, used: 3 })],
  });
  const timing = { groups: [{ id: "K1" }, { id: "K2" }] } as unknown as Timing;
  const editing = { attempt } as unknown as SignalEditing;
  const { user } = show(<IntergreenMatrix light={light} junction="10" timing={timing} editing={editing} />);
  const matrix = within(screen.getByRole("region", { name: "Matrix of intergreens" }));
  const first = matrix.getByRole("textbox", { name: /from K1 to K2/ });
  await user.clear(first);
  await user.keyboard("{Enter}");
  expect(attempt).toHaveBeenLastCalledWith(
    [{ kind: "set_intergreen", junction: "10", ending: "K1", beginning: "K2", seconds: null }],
    undefined,
  );
  expect(matrix.getByRole("textbox", { name: /from K2 to K1/ }).getAttribute("aria-invalid")).toBe("true");
  expect(screen.getByText(/3 s are shorter than the 5 s that the paths need/)).toBeTruthy();
  await user.type(first, "x{Enter}");
  expect(screen.getByRole("alert").textContent).toMatch(/number of seconds/);
  expect(attempt).toHaveBeenCalledTimes(1);
});

test("a loop lies on the nearest lane, so far before its stop line", () => {
  const lane: DetectorLane = {
    at: "1.0.-1",
    approach: "r1",
    line: [
      [100, 0],
      [50, 0],
      [50, -50],
    ],
  };
  expect(nearest(lane.line, [49, -20])).toEqual({ before: 30, away: 1 });
  expect(loopAt([lane], [49, -20], 3, 2)).toEqual({
    at: "1.0.-1",
    before: 30,
    place: [
      [50, -18],
      [50, -20],
    ],
  });
  expect(loopAt([lane], [70, 1], 3, 2)?.before).toBe(70);
  expect(loopAt([lane], [70, 9], 3, 2)).toBeNull();
});

test("the plans of a run are those of its log, or before it ends those that are planned", () => {
  expect(loggedPlans([0, 10, 20, 30], ["A", "A", "B", "B"], 40)).toEqual([
    { plan: "A", begin: 0, end: 20 },
    { plan: "B", begin: 20, end: 40 },
  ]);
  const light = program({
    plans: [
      { ...plan, id: "A", begins: [0, 200] },
      { ...plan, id: "B", begins: [100] },
    ],
  });
  const spans = plannedPlans(light, 150);
  expect(spans).toEqual([
    { plan: "A", begin: 0, end: 100 },
    { plan: "B", begin: 100, end: 150 },
  ]);
  expect([planAt(spans, 99), planAt(spans, 100)]).toEqual(["A", "B"]);
});
