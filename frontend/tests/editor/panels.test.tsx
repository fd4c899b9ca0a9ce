// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { type ComponentProps, useState } from "react";
import { expect, test, vi } from "vitest";

import type { Actor, Edit, ScenarioDocument } from "../../src/api/types";
import { ActorStep } from "../../src/editor/ActorStep";
import type { Tool } from "../../src/editor/handlers/handler";
import { HelpSheet } from "../../src/editor/HelpSheet";
import { RegionStep } from "../../src/editor/MapSteps";
import { Starts } from "../../src/editor/placing";
import { Problems } from "../../src/editor/Problems";
import { RoadUserTable } from "../../src/editor/RoadUserTable";
import { LightsStep } from "../../src/editor/LightsStep";
import { useRunChoices } from "../../src/editor/runChoices";
import { RunStep } from "../../src/editor/RunStep";
import type { RunWish } from "../../src/api/runs";
import { insideRows, STEPS } from "../../src/editor/scene";
import { type StepText, Steps } from "../../src/editor/Steps";
import { createEditorStore } from "../../src/editor/store";
import { TableForm } from "../../src/editor/TableForm";
import { Tour } from "../../src/editor/Tour";
import { Picker } from "../../src/map/picking";
import { NO_NAMES } from "../../src/map/placeNames";
import { actor, assets, flow, graph, problem, scenario } from "../example";
import { choose, fill, rowsOf, server, show } from "../page";

const table = () => screen.getByRole("table");

function Table(props: Omit<ComponentProps<typeof RoadUserTable>, "head" | "open" | "onOpen">) {
  const [open, setOpen] = useState(true);
  return <RoadUserTable head={null} open={open} onOpen={setOpen} {...props} />;
}

function listed(ones: Parameters<typeof RoadUserTable>[0]["ones"], selection: string[] = []) {
  const calls = { onSelect: vi.fn(), onSelectAll: vi.fn(), onRemove: vi.fn() };
  return {
    ...show(<Table ones={ones} graph={graph} selection={selection} place="actors" {...calls} />),
    ...calls,
  };
}

test("the table has a row for each road user and flow, in the words of the page", () => {
  const walker: Actor = { ...actor("p", "ped.1.0.3.0"), category: "pedestrian", depart: 12 };
  listed([
    { ...actor("a"), ego: true, speed: 10, goal: "1.0.-1.2" },
    walker,
    flow("f", "1.0.-1.1"),
    { ...flow("g", "ped.1.0.3.1"), mix: { pedestrian: 1 } },
  ]);
  expect(rowsOf(table()).map((row) => row.slice(0, 9))).toEqual([
    [
      "a",
      "Car",
      "any",
      "Road 1, right lane 1, 0 m",
      "Road 1, right lane 1, 4 m",
      "36 km/h",
      "after 0 s",
      "Normal",
      "yes",
    ],
    ["p", "Pedestrian", "any", "Road 1, left walkway, 0 m", "random", "default", "after 12 s", "–", ""],
    [
      "f",
      "Flow: car",
      "–",
      "Road 1, right lane 1, 2 m",
      "random",
      "speed limit",
      "0 to 3600 s",
      "300 per hour",
      "",
    ],
    [
      "g",
      "Pedestrian flow",
      "–",
      "Road 1, left walkway, 2 m",
      "random",
      "default",
      "0 to 3600 s",
      "300 per hour",
      "",
    ],
  ]);
});

test("a row is selected by a click, added with Shift, and removed without being selected", async () => {
  const { user, onSelect, onRemove } = listed([actor("a"), actor("b")], ["a"]);
  expect(screen.getByRole("button", { name: "a", pressed: true })).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "b" }));
  expect(onSelect).toHaveBeenLastCalledWith("b", false);
  await user.keyboard("{Shift>}");
  await user.click(screen.getByRole("button", { name: "b" }));
  await user.keyboard("{/Shift}");
  expect(onSelect).toHaveBeenLastCalledWith("b", true);
  await user.click(screen.getByRole("button", { name: "Remove b" }));
  expect(onRemove).toHaveBeenCalledWith(["b"]);
  expect(onSelect).toHaveBeenCalledTimes(2);
});

test("arrow keys go from row to row", async () => {
  const { user } = listed([actor("a"), actor("b")]);
  screen.getByRole("button", { name: "a" }).focus();
  await user.keyboard("{ArrowDown}");
  expect(document.activeElement?.textContent).toBe("b");
  await user.keyboard("{ArrowUp}");
  expect(document.activeElement?.textContent).toBe("a");
});

test("a long table can be searched, and only what is found is selected with all", async () => {
  const many = Array.from({ length: 9 }, (_, n) => actor(`car-${n}`));
  const { user, onSelectAll } = listed([...many, { ...actor("x"), category: "bus" }]);
  await user.type(screen.getByRole("textbox", { name: "Search the table of road users" }), "bus");
  expect(rowsOf(table()).map(([name]) => name)).toEqual(["x"]);
  await user.click(screen.getByRole("button", { name: "Select all" }));
  expect(onSelectAll).toHaveBeenCalledWith(["x"]);
  await user.type(screen.getByRole("textbox", { name: "Search the table of road users" }), "?");
  expect(screen.getByText("No road user matches “bus?”.")).toBeTruthy();
});

test("the table is there without road users, is as high, and can be hidden", async () => {
  const { user } = listed([]);
  expect(screen.getByText("No road users yet.")).toBeTruthy();
  const dock = document.querySelector(".table-dock");
  expect(dock?.getAttribute("data-open")).toBe("true");
  await user.click(screen.getByRole("button", { name: "Hide the table" }));
  expect(screen.queryByRole("table")).toBeNull();
  await user.click(screen.getByRole("button", { name: "Show the table" }));
  expect(screen.getByRole("table")).toBeTruthy();
});

test("a search of the table ends with the step, and when there is nothing left to search", async () => {
  const calls = { onSelect: vi.fn(), onSelectAll: vi.fn(), onRemove: vi.fn() };
  const many = Array.from({ length: 9 }, (_, n) => actor(`car-${n}`));
  const part = (ones: Actor[], place: string) => (
    <Table ones={ones} graph={graph} selection={[]} place={place} {...calls} />
  );
  const { user, again } = show(part(many, "actors"));
  const search = () => screen.getByRole("textbox", { name: "Search the table of road users" });
  await user.type(search(), "car-3");
  expect(rowsOf(table())).toHaveLength(1);
  again(part(many, "run"));
  expect(rowsOf(table())).toHaveLength(9);
  await user.type(search(), "car-3");
  again(part(many.slice(1), "run"));
  expect(rowsOf(table())).toHaveLength(8);
});

test("only the open step shows its form; every step can be opened at any time", async () => {
  const text = (title: string, done: boolean): StepText => ({
    title,
    done,
    note: "",
    body: <p>form of {title}</p>,
  });
  const onOpen = vi.fn();
  const { user } = show(
    <Steps
      open="region"
      onOpen={onOpen}
      steps={{
        map: text("Map", true),
        region: text("Region", false),
        environment: text("Weather and time", false),
        actors: text("Road users", false),
        traffic: text("Demand", false),
        transit: text("Public transport", false),
        lights: text("Traffic lights", false),
        measures: text("Measures", false),
        rules: text("Rules", false),
        parameters: text("Parameters", false),
        study: text("Analysis", false),
        criteria: text("Criteria", false),
        run: text("Run", false),
      }}
    />,
  );
  expect(screen.getAllByText(/^form of/).map((one) => one.textContent)).toEqual(["form of Region"]);
  expect(screen.getAllByRole("button", { expanded: false })).toHaveLength(STEPS.length - 1);
  const control = screen.getByRole("group", { name: "Control" });
  const steps = within(control).getAllByRole("region");
  expect(steps.map((one) => one.getAttribute("aria-label"))).toEqual(["Traffic lights", "Measures", "Rules"]);
  await user.click(within(screen.getByRole("region", { name: "Run" })).getByRole("button"));
  expect(onOpen).toHaveBeenCalledWith("run");
});

test("problems are listed with errors first, and each leads to its place", async () => {
  const warning = { ...problem("demand"), severity: "warning" as const, message: "too many trips" };
  const error = { ...problem("actors[0].goal"), message: "no route" };
  const onShow = vi.fn();
  const { user } = show(<Problems graph={graph} problems={[warning, error]} onShow={onShow} />);
  expect(screen.getByRole("status").textContent).toBe("2 problems found");
  expect(screen.getAllByRole("button").map((one) => one.textContent)).toEqual(["no route", "too many trips"]);
  expect(screen.getByRole("img", { name: "Must be solved" })).toBeTruthy();
  await user.click(screen.getByRole("button", { name: /no route/ }));
  expect(onShow).toHaveBeenCalledWith(error);
});

test("of very many problems the first are listed; without any there is no list", async () => {
  const many = Array.from({ length: 60 }, (_, n) => ({ ...problem(`actors[${n}]`), message: `no ${n}` }));
  const { user, again } = show(<Problems graph={graph} problems={many} onShow={vi.fn()} />);
  await user.click(screen.getByRole("button", { expanded: false }));
  expect(screen.getAllByRole("button")).toHaveLength(1 + 50);
  expect(screen.getByText("and 10 more")).toBeTruthy();
  again(<Problems graph={graph} problems={[]} onShow={vi.fn()} />);
  expect(screen.queryByRole("region", { name: "Problems" })).toBeNull();
});

test("problems of many are one line that opens, and places are named as everywhere", async () => {
  const spawn = "1.0.-1.1";
  const many = Array.from({ length: 112 }, (_, n) => ({
    ...problem(`actors[${n}].spawn`, [spawn]),
    code: "tight_curve",
    message: `car-${n} starts on '${spawn}'`,
  }));
  const other = { ...problem("demand"), code: "y", message: "no trips" };
  const onShow = vi.fn();
  const { user } = show(<Problems graph={graph} problems={[...many, other]} onShow={onShow} />);
  expect(screen.getByRole("status").textContent).toBe("113 problems found");
  expect(screen.getAllByRole("button").map((one) => one.textContent)).toEqual([
    "112 times: a long vehicle starts in a tight curve",
    "no trips",
  ]);
  await user.click(screen.getByRole("button", { name: /112 times/ }));
  await user.click(screen.getByRole("button", { name: /car-7 starts on Road 1, right lane 1, 2 m/ }));
  expect(onShow).toHaveBeenCalledWith(many[7]);
});

test("neighbours of the region are offered once they are known, and only if there are some", async () => {
  const [onAll, onWithin] = [vi.fn(), vi.fn()];
  const part = (candidates: string[], current: boolean) => (
    <RegionStep
      segments={1}
      region={{ inside: ["a"], removable: ["a"], candidates, current }}
      onNext={vi.fn()}
      onAll={onAll}
      onWhole={vi.fn()}
      onSeen={vi.fn()}
      onWithin={onWithin}
      onBegin={vi.fn()}
      onShow={vi.fn()}
    />
  );
  const { user, again } = show(part([], false));
  expect(screen.getByRole("button", { name: /^Add all/ })).toHaveProperty("disabled", true);
  again(part(["b", "c"], true));
  await user.click(screen.getByRole("button", { name: "Add all 2 neighbours" }));
  expect(onAll).toHaveBeenCalledOnce();
  again(part([], true));
  expect(screen.queryByRole("button", { name: /^Add all/ })).toBeNull();
});

test("a region is begun by a click on the map, or with what is in its middle", async () => {
  const [onBegin, onWithin] = [vi.fn(), vi.fn()];
  const { user } = show(
    <RegionStep
      segments={0}
      region={{ inside: [], removable: [], candidates: [], current: true }}
      onNext={vi.fn()}
      onAll={vi.fn()}
      onWhole={vi.fn()}
      onSeen={vi.fn()}
      onWithin={onWithin}
      onBegin={onBegin}
      onShow={vi.fn()}
    />,
  );
  await user.click(screen.getByRole("button", { name: "Start at the map centre" }));
  expect(onBegin).toHaveBeenCalledOnce();
  await user.click(screen.getByRole("button", { name: "Select all within" }));
  expect(onWithin).toHaveBeenCalledWith(300);
});

function placing(
  tool: Tool | null,
  selected: Parameters<typeof ActorStep>[0]["selected"],
  document: ScenarioDocument,
) {
  const calls = {
    onTool: vi.fn(),
    onPlaceSomewhere: vi.fn(),
    onEdit: vi.fn<(edit: Edit | readonly Edit[], label?: string) => void>(),
    onStart: vi.fn(),
    onGoal: vi.fn(),
    onRemove: vi.fn(),
    onSelect: vi.fn(),
    onShowGoals: vi.fn(),
    onFill: vi.fn(),
  };
  const starts = new Starts(graph, new Picker(graph), insideRows(graph, document.roi), document);
  const part = (hand: Tool | null) => (
    <ActorStep
      assets={assets}
      graph={graph}
      starts={starts}
      selected={selected}
      tool={hand}
      goals={null}
      actors={1}
      profiles={{}}
      driverSets={[]}
      filling={false}
      {...calls}
    />
  );
  const { again, ...rest } = show(part(tool));
  return { ...rest, ...calls, hold: (hand: Tool | null) => again(part(hand)) };
}

test("a kind is taken into the hand and put back with the same button", async () => {
  const { user, onTool, onPlaceSomewhere, hold } = placing(null, [], scenario([]));
  expect(screen.getByText("Choose a kind, then click on the map to place it.")).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Pedestrian" }));
  const tool = onTool.mock.lastCall?.[0] as Tool;
  hold(tool);
  expect(screen.getByRole("button", { name: "Pedestrian", pressed: true })).toBeTruthy();
  expect(
    screen.getByText(
      "Now click where the pedestrian starts, on a sidewalk or crosswalk. Escape stops placing.",
    ),
  ).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Use the next free point" }));
  expect(onPlaceSomewhere).toHaveBeenCalledOnce();
  await user.click(screen.getByRole("button", { name: "Pedestrian" }));
  expect(onTool).toHaveBeenLastCalledWith(null);
});

test("flows of vehicles and of pedestrians are offered", () => {
  placing(null, [], scenario([]));
  const group = within(screen.getByRole("group", { name: "Flow to place" }));
  expect(group.getAllByRole("button").map((one) => one.textContent)).toEqual([
    "Vehicle flow",
    "Pedestrian flow",
  ]);
});

test("a change of several road users is one change; flows among them are left as they are", async () => {
  const [a, b, f] = [actor("a"), actor("b", "1.0.-1.1"), flow("f", "1.0.-1.2")];
  const { user, onEdit } = placing(null, [a, b, f], scenario([a, b], ["a", "b"], [f]));
  expect(screen.getByRole("region", { name: "Settings of 3 road users" })).toBeTruthy();
  await fill(user, "All depart after", "5");
  expect(onEdit).toHaveBeenCalledExactlyOnceWith(
    [
      { kind: "change_actor", actor: "a", depart: 5 },
      { kind: "change_actor", actor: "b", depart: 5 },
    ],
    "Departure of 2 road users",
  );
});

const OPTION = { meaning: "", low: 0, high: 10, choices: [] };
const BEHAVIOURS = [
  {
    name: "idm",
    summary: "Intelligent driver model (IDM), with lane changes by MOBIL.",
    error: "",
    options: [{ ...OPTION, name: "headway", kind: "number", title: "Time headway, s", usual: 1.2 }],
  },
  { name: "gone", summary: "", options: [], error: "it cannot be imported" },
];
const SIMULATORS = ["sumo", "carla-mirror", "carla-native", "steady"].map((name) => ({
  name,
  summary: "",
  options: [],
  error: "",
}));
const CARLA = { state: "absent", address: "", message: "No CARLA server is there." };

type RunProps = Omit<Parameters<typeof RunStep>[0], "choices" | "onRun"> & { onRun: (wish: RunWish) => void };

function ChosenRun({ onRun, ...props }: RunProps) {
  const choices = useRunChoices(props.name, props.document.simulation.duration);
  return <RunStep {...props} choices={choices} onRun={() => onRun(choices.started)} />;
}

function toRun(document: ScenarioDocument, more: Partial<RunProps> = {}) {
  server({
    "/carla": CARLA,
    "/behaviours": BEHAVIOURS,
    "/simulators/steady/unsupported": [
      { ...problem("rules[0]"), message: "Steady traffic does not follow rule r" },
    ],
    "/simulators": SIMULATORS,
  });
  const [onEdit, onRun] = [vi.fn(), vi.fn()];
  const shown = show(
    <ChosenRun
      name="s"
      version={1}
      document={document}
      places={NO_NAMES}
      blocked={false}
      empty={false}
      busy={false}
      onEdit={onEdit}
      onRun={onRun}
      {...more}
    />,
  );
  return { ...shown, onEdit, onRun };
}

test("a run is played by the simulator that is chosen, and what that leaves out is said before", async () => {
  const { user, onRun } = toRun(scenario([actor("a")]));
  await screen.findByRole("textbox", { name: "Simulator" });
  await choose(user, "Simulator", "steady");
  expect(await screen.findByText("Steady traffic does not follow rule r")).toBeTruthy();
  expect(screen.queryByLabelText("Vehicles and lights controlled by")).toBeNull();
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun).toHaveBeenLastCalledWith({
    scenario: "s",
    trajectories: true,
    every: null,
    simulator: { name: "steady", options: {} },
  });
});

test("measures are listed with what they do and when", () => {
  const measures: ScenarioDocument["measures"] = [
    { id: "shut", kind: "closure", begin: 60, end: 120, places: ["r1"], destinations: "leave" },
    {
      id: "buses",
      kind: "permission",
      begin: 0,
      end: null,
      places: ["1.0.-1"],
      allowed: ["bus"],
      banned: [],
    },
  ];
  toRun({ ...scenario([actor("a")]), measures });
  expect(screen.getByText("Closure shut")).toBeTruthy();
  expect(screen.getByText("r1; 1:00.0 to 2:00.0")).toBeTruthy();
  expect(screen.getByText("only bus: 1.0.-1; 0:00.0 to the end")).toBeTruthy();
});

test("SUMO drives the vehicles, or a behaviour model with options that differ from its usual ones", async () => {
  const { user, onRun } = toRun(scenario([actor("a")]));
  expect(await screen.findByRole("textbox", { name: "Vehicles and lights controlled by" })).toHaveProperty(
    "value",
    "SUMO’s drivers",
  );
  await choose(user, "Vehicles and lights controlled by", "Intelligent driver model");
  expect(screen.getByText(/with lane changes by MOBIL/)).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun.mock.lastCall?.[0]).toHaveProperty("behaviour", { name: "idm", options: {} });
  await fill(user, "Time headway, s", "0.8");
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun.mock.lastCall?.[0]).toHaveProperty("behaviour", { name: "idm", options: { headway: 0.8 } });
  await choose(user, "Vehicles and lights controlled by", "Behaviour model gone");
  expect(screen.getByRole("alert").textContent).toContain("it cannot be imported");
  await choose(user, "Vehicles and lights controlled by", "SUMO’s drivers");
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun.mock.lastCall?.[0]).not.toHaveProperty("behaviour");
});

test("a run begins in real time with its trajectories, unless another choice is made", async () => {
  const { user, onRun } = toRun(scenario([actor("a")]));
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun).toHaveBeenLastCalledWith({
    scenario: "s",
    speed: 1,
    carla: false,
    trajectories: true,
    every: null,
  });
  await user.click(screen.getByRole("radio", { name: "As fast as possible" }));
  await choose(user, "Record trajectories", "Every 10 seconds");
  await user.click(screen.getByRole("button", { name: "Run" }));
  expect(onRun).toHaveBeenLastCalledWith({
    scenario: "s",
    speed: null,
    carla: false,
    trajectories: true,
    every: 10,
  });
  expect(await screen.findByText("CARLA not connected")).toBeTruthy();
});

test("lights are chosen by their junction, fixed-time or actuated; a map without them says so", async () => {
  const [onEdit, onShow] = [vi.fn(), vi.fn()];
  const step = (junctions: readonly string[]) => (
    <LightsStep
      junctions={junctions}
      places={NO_NAMES}
      shown="7"
      control="fixed"
      onEdit={onEdit}
      onShow={onShow}
    />
  );
  const { user, again } = show(step(["5", "7"]));
  expect(screen.getByRole("button", { name: "Junction 7" }).getAttribute("aria-pressed")).toBe("true");
  await user.click(screen.getByRole("button", { name: "Junction 5" }));
  expect(onShow).toHaveBeenCalledExactlyOnceWith("5");
  expect(screen.getByText("Every signal keeps its times.")).toBeTruthy();
  await user.click(screen.getByRole("radio", { name: "Actuated" }));
  expect(onEdit).toHaveBeenCalledWith({ kind: "set_signal_control", control: "actuated" });
  again(step([]));
  expect(screen.queryByRole("radiogroup", { name: "Signal control" })).toBeNull();
  expect(screen.getByText("This map has no traffic lights.")).toBeTruthy();
});

test("another random seed is a change; the same one is none", async () => {
  const { user, onEdit } = toRun(scenario([actor("a")]));
  await fill(user, "Random seed", "0");
  expect(onEdit).not.toHaveBeenCalled();
  await fill(user, "Random seed", "42");
  expect(onEdit).toHaveBeenCalledExactlyOnceWith({ kind: "set_seed", seed: 42 });
});

test("a long run is offered as fast as possible, and says that it can be resumed", () => {
  const whole = scenario([actor("a")]);
  toRun({ ...whole, simulation: { ...whole.simulation, duration: 7200, step_length: 1 } });
  expect(screen.getByRole("radio", { name: "As fast as possible" })).toHaveProperty("checked", true);
  expect(screen.getByText(/can be resumed from the last full hour/)).toBeTruthy();
});

test("an empty scenario, or one with errors, cannot be run and says why", () => {
  const { again } = toRun(scenario([]), { empty: true });
  expect(screen.getByRole("button", { name: "Run" })).toHaveProperty("disabled", true);
  expect(screen.getByText(/There are no road users yet/)).toBeTruthy();
  again(
    <ChosenRun
      name="s"
      version={1}
      document={scenario([])}
      places={NO_NAMES}
      blocked
      empty={false}
      busy={false}
      onEdit={vi.fn()}
      onRun={vi.fn()}
    />,
  );
  expect(screen.getByRole("button", { name: "Run" })).toHaveProperty("disabled", true);
  expect(screen.getByText("Solve the problems listed below first.")).toBeTruthy();
});

test("a table that is refused lists every reason, and one that is imported says so", async () => {
  const document = scenario([]);
  const store = createEditorStore("s");
  server({ "/scenarios/s": { name: "s", version: 1, document, problems: [] } });
  await store.getState().load();
  const { user } = show(<TableForm store={store} demand={document.demand} roads={["r1", "r2"]} />);
  expect(screen.getByLabelText("An example").textContent).toBe("from,to,trips\nr1,r2,120\nr2,r1,90\n");
  await choose(user, "Contents of the table", "Counts");
  expect(screen.getByRole("textbox", { name: "Name" })).toHaveProperty("value", "counts");
  vi.stubGlobal("fetch", () =>
    Promise.resolve(
      new Response(
        JSON.stringify({
          error: { kind: "TableError", message: "no", problems: ["line 2: no place", "line 3: no count"] },
        }),
        { status: 422 },
      ),
    ),
  );
  const input = window.document.querySelector<HTMLInputElement>("input[type=file]");
  if (!input) throw new Error("there is no field for a file");
  await user.upload(input, new File(["x"], "mine.csv", { type: "text/csv" }));
  expect(await screen.findByText("mine.csv was not imported")).toBeTruthy();
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([
    "Line 2: no place",
    "Line 3: no count",
  ]);
});

test("the tour has three cards and ends with the last", async () => {
  const onClose = vi.fn();
  const { user } = show(<Tour step="map" onClose={onClose} />);
  expect(screen.queryByRole("button", { name: "Back" })).toBeNull();
  await user.click(screen.getByRole("button", { name: "Next" }));
  await user.click(screen.getByRole("button", { name: "Next" }));
  expect(screen.getByText("3. Run it")).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Done" }));
  expect(onClose).toHaveBeenCalledOnce();
});

test("the tour follows the steps that are opened", () => {
  const { again } = show(<Tour step="region" onClose={vi.fn()} />);
  expect(screen.getByText("1. Choose where")).toBeTruthy();
  again(<Tour step="actors" onClose={vi.fn()} />);
  expect(screen.getByText("2. Choose who")).toBeTruthy();
  again(<Tour step="traffic" onClose={vi.fn()} />);
  expect(screen.getByText("2. Choose who")).toBeTruthy();
  again(<Tour step="run" onClose={vi.fn()} />);
  expect(screen.getByText("3. Run it")).toBeTruthy();
});

test("the help has the shortcuts and explains the terms of the page, each once", async () => {
  const { user } = show(<HelpSheet open onClose={vi.fn()} />);
  expect(screen.getByText("Ctrl+Z / Ctrl+Y")).toBeTruthy();
  await user.click(screen.getByRole("tab", { name: "Glossary" }));
  const terms = [...document.querySelectorAll("dt")].map((one) => one.textContent);
  for (const term of [
    "Region of interest (study area)",
    "Teleported",
    "Not inserted",
    "Control delay",
    "Intergreen",
    "Random seed",
    "Time to collision",
  ]) {
    expect(terms).toContain(term);
  }
  expect(new Set(terms).size).toBe(terms.length);
});
