// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { PlacePick } from "../../src/editor/pick";
import { type LightProgram, signals, type TimedSignals } from "../../src/api/signals";
import type { SignalEditing, Timing } from "../../src/signals/editing";
import { QueueLanes } from "../../src/signals/queues";
import { detectorNames } from "../../src/map/detectorMarks";
import { sceneDetectors } from "../../src/signals/sceneDetectors";
import { QueueTable } from "../../src/signals/QueueTable";
import { SignalPanel } from "../../src/signals/SignalPanel";
import { Graph } from "../../src/map/graph";
import type { GraphColumns, MapDetails } from "../../src/api/types";
import { ApproachNames, NO_NAMES } from "../../src/map/placeNames";
import { rowsOf, show } from "../page";
import { detector, program } from "./program";

const timing = (more: Partial<Timing> = {}): Timing => ({
  junction: "10",
  control: null,
  offset: 0,
  green: [],
  cycle: null,
  coordination: null,
  groups: [],
  stages: [],
  intergreens: [],
  detectors: [],
  plans: [],
  bus_priority: null,
  ...more,
});

const NOT_PICKING: PlacePick = {
  now: null,
  start: vi.fn(),
  stop: vi.fn(),
  begin: vi.fn(),
  taker: { current: vi.fn() },
};

const editable = (more: Partial<SignalEditing> = {}): SignalEditing => ({
  name: "one",
  timing: timing(),
  control: "fixed",
  edit: vi.fn(() => Promise.resolve(true)),
  attempt: vi.fn(() => Promise.resolve(null)),
  pick: NOT_PICKING,
  retime: vi.fn(() => Promise.resolve(true)),
  takeOver: vi.fn(() => Promise.resolve(true)),
  time: vi.fn(() => Promise.resolve({ notes: ["cycle 60 s (was 40 s)"], picture: "" })),
  ...more,
});

const panel = (
  light: LightProgram,
  editing: SignalEditing,
  junctions: readonly string[] = ["10"],
  places = NO_NAMES,
) => {
  const load = () => Promise.resolve(light);
  return (
    <SignalPanel
      junctions={junctions}
      junction="10"
      places={places}
      onJunction={vi.fn()}
      load={load}
      editing={editing}
    />
  );
};
const turn = { approach: "r1", turn: "left", treatment: "permissive", alone: true } as const;

test("a green is changed in the plan that is shown, and may be taken from the next stage", async () => {
  const editing = editable({
    timing: timing({ plans: [{ id: "day", times: ["06:00"], offset: 5 }] as Timing["plans"] }),
  });
  const { user } = show(panel(program(), editing));
  (await screen.findByRole("slider", { name: "Green of stage 1" })).focus();
  await user.keyboard("{ArrowUp}{Enter}");
  expect(editing.retime).toHaveBeenLastCalledWith({ is: "green", stage: "1" }, 16, "day", false);
  await user.click(screen.getByRole("switch", { name: /^Keep the cycle/ }));
  screen.getByRole("slider", { name: "Green of stage 1" }).focus();
  await user.keyboard("{ArrowUp}{Enter}");
  expect(editing.retime).toHaveBeenLastCalledWith({ is: "green", stage: "1" }, 17, "day", true);
});

test("a turn gets an arrow, a stage a call, the light another control", async () => {
  const editing = editable();
  const { user } = show(panel(program({ turns: [turn] }), editing));
  await user.click(await screen.findByRole("radio", { name: "Gaps and arrow" }));
  expect(editing.edit).toHaveBeenLastCalledWith({
    kind: "set_turn",
    junction: "10",
    approach: "r1",
    turn: "left",
    treatment: "both",
  });
  // Stage 1 is the first and waits for nobody; stage 2 is on call already.
  const [call, ...more] = screen.getAllByRole("switch", { name: /only when called/ });
  expect(more).toEqual([]);
  await user.click(call as HTMLElement);
  expect(editing.edit).toHaveBeenLastCalledWith({
    kind: "set_stage",
    junction: "10",
    stage: "2",
    on_call: false,
  });
  await user.click(screen.getByRole("button", { name: "Back to the program of the map" }));
  expect(editing.edit).toHaveBeenLastCalledWith({ kind: "clear_timing", junction: "10" });
});

test("the program of the map has to be made the scenario's own before its turns change", async () => {
  const editing = editable({ timing: null });
  const { user } = show(panel(program({ origin: "odscen", turns: [turn] }), editing));
  const choice = await screen.findByRole("radio", { name: "Arrow only" });
  expect(choice).toHaveProperty("disabled", true);
  expect(screen.queryByRole("link", { name: "Export for SUMO" })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Customise this program" }));
  expect(editing.takeOver).toHaveBeenCalledTimes(1);
});

test("lights are timed by buttons, and what came of it is said", async () => {
  const editing = editable();
  const { user } = show(panel(program(), editing, ["10", "11"]));
  await user.click(await screen.findByRole("button", { name: "Optimise for demand (Webster)" }));
  expect(await screen.findByText("cycle 60 s (was 40 s)")).toBeTruthy();
  await user.click(screen.getByText("Green wave along several lights"));
  expect(screen.getByRole("button", { name: "Coordinate two lights or more" })).toHaveProperty(
    "disabled",
    true,
  );
  const href = screen.getByRole("link", { name: "Export for SUMO" }).getAttribute("href");
  expect(href).toBe("/api/scenarios/one/signals.add.xml");
});

test("timing gives turns arrows, too, if that is switched on", async () => {
  const webster = vi.spyOn(signals, "webster").mockResolvedValue({} as TimedSignals);
  const editing = editable({
    time: vi.fn(async (call) => {
      await call(3);
      return { notes: [], picture: "" };
    }),
  });
  const { user } = show(panel(program(), editing, ["10", "11"]));
  await user.click(await screen.findByRole("button", { name: "Optimise for demand (Webster)" }));
  expect(webster).toHaveBeenLastCalledWith("one", 3, ["10"], false);
  await user.click(screen.getByRole("switch", { name: /^Add protected turns/ }));
  await user.click(screen.getByRole("button", { name: "Time all 2 lights" }));
  expect(webster).toHaveBeenLastCalledWith("one", 3, [], true);
  webster.mockRestore();
});

test("detectors lie on the map where they are, filled if occupied, and are named once for all lanes", () => {
  const loops = [0, 3].map((y) =>
    detector(`J1.D1.${y}`, {
      place: [
        [28, y],
        [30, y],
      ],
    }),
  );
  const call = detector("J1.call.0", { label: "C0", call: true, place: [[0, 5]] });
  const drawn = sceneDetectors(program({ detectors: [...loops, call] }), new Set(["J1.D1.3"]));
  expect(drawn.map(({ place, occupied }) => [place.length, occupied])).toEqual([
    [2, false],
    [2, true],
    [1, false],
  ]);
  expect(detectorNames(drawn)).toEqual([
    { x: 30, y: 0, label: "D1" },
    { x: 0, y: 5, label: "C0" },
  ]);
  expect(sceneDetectors(null)).toEqual([]);
});

/** A straight lane of 20 nodes eastwards to a stop line at x = 40. */
function lane(): Graph {
  const n = 20;
  const all = <T,>(value: T): T[] => Array.from({ length: n }, () => value);
  const columns = {
    x: all(0).map((_, i) => 2 + 2 * i - 1),
    y: all(0),
    hdg: all(0),
    segment: all(0),
    lane: all(0),
    lane_keys: ["1.0.-1"],
    first_node: [0],
    edges: {
      source: all(0)
        .map((_, i) => i)
        .slice(0, -1),
      target: all(0)
        .map((_, i) => i + 1)
        .slice(0, -1),
      relation: all(0).slice(0, -1),
    },
    segments: [{ id: "r1" }],
    walks: { x: [], lane_keys: [], first_node: [], lane: [] },
  };
  return new Graph(columns as unknown as GraphColumns);
}

test("vehicles that wait one behind the other are a queue; who drives, or waits far behind, is not", () => {
  const paths: [number, number][][] = [
    [
      [40, 0],
      [45, 0],
    ],
  ];
  const light = { id: "J", names: ["10"], green: [], signals: [[]], paths, walks: [false] };
  const lanes = new QueueLanes(lane(), light as MapDetails["lights"][number]);
  // Index, x, y, hdg, speed, flags: middles of vehicles of 5 m.
  const rows = [
    [0, 37, 0, 0, 0, 0],
    [1, 30, 0.3, 0, 1, 0],
    [2, 22, 0, 0, 6, 0],
    [3, 5, 0, 0, 0, 0],
    [4, 33, 3.5, 0, 0, 0],
    [5, 33, 0, Math.PI, 0, 0],
  ];
  const frame = { step: 0, time: 0, count: 6, pace: 1, arrived: 0, rows: Float32Array.from(rows.flat()) };
  const [queue] = lanes.at(frame, () => 5, [0, 0]);
  expect(queue?.approach).toBe("r1");
  expect(queue?.vehicles).toBe(2);
  expect(queue?.metres).toBeCloseTo(11.5, 0);
});

test("queues are a table, and none has no end", () => {
  const queues = [
    { approach: "r1", vehicles: 3, metres: 21.4 },
    { approach: "r2", vehicles: 0, metres: 0 },
  ];
  show(<QueueTable queues={queues} names={new ApproachNames(NO_NAMES, null)} />);
  expect(rowsOf(screen.getByRole("table", { name: "Queues now" }))).toEqual([
    ["r1", "3", "21 m"],
    ["r2", "0", "–"],
  ]);
});
