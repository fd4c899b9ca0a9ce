// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { FitRow, Incident, RunInfo, RunProgress, RunState } from "../../src/api/runs";
import { CarlaChoice } from "../../src/carla/CarlaChoice";
import { Chart } from "../../src/run/Chart";
import { Criteria } from "../../src/run/Criteria";
import { CountsFit } from "../../src/run/CountsFit";
import { Egos } from "../../src/run/Egos";
import { EarlierRuns } from "../../src/run/EarlierRuns";
import { IncidentLog } from "../../src/run/IncidentLog";
import { Legend } from "../../src/run/Legend";
import { Interrupted, SafeSlices } from "../../src/run/LongRun";
import { Result } from "../../src/run/Result";
import { LiveStrip } from "../../src/run/Strip";
import { NO_NAMES } from "../../src/map/placeNames";
import { FIGURES } from "../figures";
import { summary } from "../messages";
import { rowsOf, server, show } from "../page";

const info = (state: RunState, more: Partial<RunInfo> = {}): RunInfo => ({
  run: "r1",
  state,
  scenario: "s",
  map: "m",
  speed: 1,
  progress: null,
  summary: null,
  preparing: null,
  clock: null,
  error: null,
  finished: null,
  carla: false,
  slices: null,
  ...more,
});
const progressAt = (time: number, until: number, more: Partial<RunProgress> = {}): RunProgress => ({
  time,
  until,
  running: 1,
  departed: 1,
  arrived: 0,
  planned: 9,
  time_left: null,
  ...more,
});
const now = { time: 65, pace: 2.5, running: 7, arrived: 3, there: new Set<string>() };

const REASON = "unresolved gridlock, first at e_0 since 700 s";
const GRIDLOCKED = summary({
  usable: {
    level: "not usable",
    headline: `not usable: ${REASON}`,
    reasons: [
      { kind: "gridlock", level: "not usable", value: 300, count: 1, words: REASON, places: ["e_0"] },
    ],
  },
});

test("a run is paused, resumed and stopped; its state is learned from the answer", async () => {
  const asked = server({ "/runs/r1/control": info("paused", { speed: 1 }) });
  const learn = vi.fn();
  const progress = progressAt(65, 600, { running: 7, departed: 10, arrived: 3, planned: 20 });
  const { user, again } = show(
    <LiveStrip info={info("running", { progress })} now={now} onBack={vi.fn()} learn={learn} />,
  );
  expect(screen.getByText("Real-time factor").previousElementSibling?.textContent).toBe("2.5");
  await user.click(screen.getByRole("button", { name: "Pause" }));
  expect(learn).toHaveBeenCalledWith("paused", 1);
  again(<LiveStrip info={info("paused", { progress })} now={now} onBack={vi.fn()} learn={learn} />);
  await user.click(screen.getByRole("button", { name: "Resume" }));
  await user.click(screen.getByRole("button", { name: "Stop" }));
  expect(asked.map(({ body }) => body)).toEqual([
    { action: "pause" },
    { action: "resume" },
    { action: "stop" },
  ]);
});

test("a long run can be interrupted to be resumed later, and says how long it still takes", () => {
  const progress = progressAt(60, 7200, { time_left: 3600 });
  show(
    <LiveStrip
      info={info("running", { speed: null, progress, slices: { done: 0, length: 3600, time: 0 } })}
      now={now}
      onBack={vi.fn()}
      learn={vi.fn()}
    />,
  );
  expect(screen.getByRole("button", { name: "Pause and save" })).toHaveProperty("disabled", false);
  expect(screen.queryByRole("button", { name: "One step" })).toBeNull();
  expect(screen.getByText("Running, about 1 h 01 min left")).toBeTruthy();
});

test("an interrupted run is resumed from what is saved", async () => {
  const asked = server({ "/runs/r1/resume": { run: "r1" } });
  const onResume = vi.fn();
  const progress = progressAt(5000, 10_800);
  const { user } = show(
    <Interrupted
      info={info("interrupted", { progress, slices: { done: 1, length: 3600, time: 3600 } })}
      onBack={vi.fn()}
      onResume={onResume}
    />,
  );
  expect(screen.getByText(/^1 h of 3 h are completed and saved\./)).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Resume" }));
  expect(asked.map(({ path }) => path)).toEqual(["/api/runs/r1/resume"]);
  expect(onResume).toHaveBeenCalledOnce();
});

test("what is saved of a long run is said while it runs", () => {
  const progress = progressAt(5000, 10_800);
  const { again } = show(
    <SafeSlices info={info("running", { progress, slices: { done: 1, length: 3600, time: 3600 } })} />,
  );
  expect(screen.getByText("1 of 3 parts completed and saved")).toBeTruthy();
  again(<SafeSlices info={info("running", { progress })} />);
  expect(screen.queryByRole("status")).toBeNull();
});

test("the result says what became of the ego, and nothing where there is none", async () => {
  const ego = {
    travel_time: null,
    delay: null,
    mean_speed: null,
    collisions: 0,
    emergency_stops: 0,
    teleports: 0,
  };
  server({
    "/r1/egos": {
      egos: [
        { ...ego, id: "car-1", status: "arrived", travel_time: 41.24, delay: 6, mean_speed: 10 },
        { ...ego, id: "car-2", status: "running", collisions: 1, emergency_stops: 2 },
      ],
    },
    "/r2/egos": { egos: [] },
  });
  const { again } = show(<Egos run="r1" />);
  const said = await screen.findByRole("region", { name: "Ego" });
  expect([...said.querySelectorAll("p")].map((one) => one.textContent)).toEqual([
    "car-1 reached its goal, in 41.2 s, 6.0 s of it delay, 36 km/h on average: no incident.",
    "car-2 was still on its way at the end: 1 collision, 2 emergency brakings.",
  ]);
  again(<Egos key="r2" run="r2" />);
  await Promise.resolve();
  expect(screen.queryByRole("region", { name: "Ego" })).toBeNull();
});

test("a run that ends while the list is open does not stay live in it", async () => {
  vi.useFakeTimers({ toFake: ["setInterval", "clearInterval"] });
  try {
    const answers: Record<string, unknown> = { "/runs?": [info("running")] };
    const asked = server(answers);
    show(<EarlierRuns scenario="s" />);
    expect(await screen.findByText("Running")).toBeTruthy();
    answers["/runs?"] = [info("completed", { finished: 1.8e9 })];
    vi.advanceTimersByTime(2000);
    expect(await screen.findByText("Finished")).toBeTruthy();
    const before = asked.length;
    vi.advanceTimersByTime(20_000);
    expect(asked).toHaveLength(before);
  } finally {
    vi.useRealTimers();
  }
});

test("earlier runs are listed newest first, and those that were interrupted can be resumed", async () => {
  const asked = server({
    "/removal": { kind: "run", name: "s-1", scenarios: 0, runs: 0, live: 0 },
    "/runs": [
      info("completed", { run: "s-1", finished: 1e9, summary: GRIDLOCKED }),
      info("interrupted", { run: "s-2" }),
    ],
  });
  const { user } = show(<EarlierRuns scenario="s" />);
  expect(await screen.findByRole("link", { name: "Resume s-2" })).toBeTruthy();
  expect(rowsOf(screen.getByRole("table")).map((row) => row[1])).toEqual([
    "Interrupted",
    "Finished, results not valid",
  ]);
  expect(screen.queryByRole("link", { name: "Report of s-2" })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Remove s-1" }));
  await screen.findByText(/wastebasket for 30 days/);
  await user.click(screen.getByRole("button", { name: "Remove" }));
  expect(asked.filter(({ path }) => path === "/api/runs/s-1")).toHaveLength(1);
});

test("the figures of a run have the labels, units and definitions of the server's registry", async () => {
  const delay = FIGURES.map((one) =>
    one.name === "mean_delay" ? { ...one, definition: "Time lost per trip." } : one,
  );
  server({ "/figures": delay, "/r1/egos": { egos: [] }, "/runs/r1/files": [], "/runs": [] });
  const known = summary({ figures: { mean_speed: 10, mean_delay: 75 } }, { planned: 4, arrived: 3 });
  show(
    <Result
      info={info("completed", { summary: known })}
      scenario="s"
      onBack={vi.fn()}
      onResume={vi.fn()}
      onShow={null}
    />,
  );
  const term = await screen.findByText("Mean delay");
  expect(screen.getAllByRole("term").map((one) => one.textContent)).toEqual([
    "Arrived",
    "Mean speed",
    "Mean delay",
  ]);
  expect(screen.getAllByRole("definition").map((one) => one.textContent)).toEqual([
    "3",
    "36.0 km/h",
    "1:15.0",
  ]);
  expect(term.parentElement?.title).toBe("Time lost per trip.");
});

test("a failed run shows the messages of the simulator", () => {
  server({ "/figures": FIGURES });
  show(
    <Result
      info={info("failed", { error: "Error: no lane" })}
      scenario="s"
      onBack={vi.fn()}
      onResume={vi.fn()}
      onShow={null}
    />,
  );
  expect(screen.getByRole("heading", { name: "The run failed" })).toBeTruthy();
  expect(screen.getByText("Error: no lane")).toBeTruthy();
  expect(screen.queryByRole("link", { name: "Full report" })).toBeNull();
});

test("incidents are reported newest first in the terms of the field, and lead to their place", async () => {
  const crash: Incident = { time: 3, kind: "collision", actor: "a", partner: "b", x: 1, y: 2 };
  const teleported: Incident = { time: 310, kind: "teleport_start", actor: "c" };
  const onShow = vi.fn();
  const { user, again } = show(
    <IncidentLog
      incidents={[teleported, crash]}
      categories={new Map([["c", "truck"]])}
      over
      onShow={onShow}
    />,
  );
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([
    "5:10.0Truck c was gridlocked and teleported",
    "0:03.0a collided with b",
  ]);
  await user.click(screen.getByRole("button", { name: /collided/ }));
  expect(onShow).toHaveBeenCalledWith(crash);
  again(<IncidentLog incidents={[]} categories={new Map()} over onShow={onShow} />);
  expect(screen.getByText("There were no incidents.")).toBeTruthy();
});

const row = (place: string, geh: number): FitRow => ({
  counts: "c",
  place,
  begin: 0,
  end: 900,
  counted: 100,
  modelled: 40,
  geh,
  met: geh <= 5,
  why: "",
  x: 1,
  y: 2,
});

test("counts that are not met are listed worst first with their count station", async () => {
  server({
    "/runs/r1/fit": {
      rows: [row("r1", 6), row("r2", 1), row("r3>j4", 9)],
      met: 1,
      hours: 0,
      hours_met: 0,
      rmse: 2,
      contradictions: [],
    },
  });
  const [onFit, onShow] = [vi.fn(), vi.fn()];
  const { user } = show(<CountsFit run="r1" places={NO_NAMES} onFit={onFit} onShow={onShow} />);
  expect(await screen.findByRole("heading", { name: "1 of 3 counts met (33 %)" })).toBeTruthy();
  expect(rowsOf(screen.getByRole("table", { name: "Counts that are not met" }))).toEqual([
    ["r3 > j40–15 min", "100", "40", "9.0"],
    ["r10–15 min", "100", "40", "6.0"],
  ]);
  await user.click(screen.getByRole("button", { name: "r1" }));
  expect(onShow).toHaveBeenCalledWith(1, 2);
  await user.click(screen.getByRole("button", { name: "Show all counts" }));
  expect(rowsOf(screen.getByRole("table", { name: "All counts" }))).toHaveLength(3);
});

test("criteria say whether they are met, their values, and lead to their moments", async () => {
  const onShow = vi.fn();
  const { user } = show(
    <Criteria
      criteria={[
        {
          criterion: "collided == 0",
          words: "In collisions: exactly 0",
          value: 0,
          unit: "",
          passed: true,
          time: null,
        },
        {
          criterion: "min_ttc(ego) >= 1.5 s",
          words: "TTC of ego: at least 1.5 s",
          value: 0.5249,
          unit: "s",
          passed: false,
          time: 12,
        },
        {
          criterion: "min_pet(ego) >= 1 s",
          words: "PET of ego: at least 1 s",
          value: null,
          unit: "s",
          passed: true,
          time: null,
        },
      ]}
      onShow={onShow}
    />,
  );
  expect(screen.getByRole("heading", { name: "1 of 3 criteria not met" })).toBeTruthy();
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([
    "Met: In collisions: exactly 0, is 0",
    "Not met: TTC of ego: at least 1.5 s, is 0.52 s0:12.0",
    "Met: PET of ego: at least 1 s (not measured)",
  ]);
  await user.click(screen.getByRole("button", { name: "Show TTC of ego: at least 1.5 s at 0:12.0" }));
  expect(onShow).toHaveBeenCalledWith(12);
});

test("the legend has only what can be in the picture", () => {
  show(
    <Legend
      categories={new Set(["bus", "car"])}
      ego={false}
      lights={false}
      lamps={false}
      marks={new Set(["teleported"])}
    />,
  );
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([
    "Car",
    "Bus",
    "Removed and re-inserted (SUMO “teleport”)",
  ]);
});

test("a chart is a table too, with gaps where nothing is known", () => {
  show(
    <Chart
      title="Speed"
      xLabel="Time, s"
      yLabel="km/h"
      x={[0, 60]}
      series={[{ name: "Mean", color: "red", values: [null, 30] }]}
    >
      How to read it.
    </Chart>,
  );
  expect(rowsOf(screen.getByRole("table", { name: "Speed in numbers", hidden: true }))).toEqual([
    ["0", "–"],
    ["60", "30"],
  ]);
});

test.each([
  ["connected", "CARLA connected", 1],
  ["absent", "CARLA not connected", 0],
  ["wrong_version", "CARLA has another version", 0],
] as const)("whether CARLA can show the run is said: %s", async (state, text, switches) => {
  server({ "/carla": { state, address: "", message: "what to do" } });
  show(<CarlaChoice chosen={false} onChoose={vi.fn()} />);
  expect(await screen.findByText(text)).toBeTruthy();
  expect(screen.queryAllByRole("switch")).toHaveLength(switches);
  expect(screen.queryAllByText("what to do")).toHaveLength(1 - switches);
});

test("a gridlocked run is not simply finished: the result opens with why it is not usable", () => {
  server({ "/figures": FIGURES, "/r1/egos": { egos: [] }, "/runs": [] });
  show(
    <Result
      info={info("completed", { summary: GRIDLOCKED })}
      scenario="s"
      onBack={vi.fn()}
      onResume={vi.fn()}
      onShow={null}
    />,
  );
  expect(screen.getByRole("heading", { level: 2 }).textContent).toBe("Run finished: results not valid");
  expect(screen.getByText("The figures of this run cannot be used")).toBeTruthy();
  expect(screen.getByText(/^unresolved gridlock, first at e_0/)).toBeTruthy();
});
