// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { Background } from "../../src/api/demand";
import { models } from "../../src/api/models";
import { ActorForm, ManyForm } from "../../src/editor/ActorForm";
import { BackgroundForm } from "../../src/editor/BackgroundForm";
import { Duration } from "../../src/editor/Duration";
import { FillForm } from "../../src/editor/FillForm";
import { FlowForm } from "../../src/editor/FlowForm";
import { ParkingForm } from "../../src/editor/ParkingForm";
import { MixForm } from "../../src/editor/MixForm";
import { Starts } from "../../src/editor/placing";
import { insideRows } from "../../src/editor/scene";
import { StartAndGoal } from "../../src/editor/StartAndGoal";
import { nth } from "../../src/lists";
import { Picker } from "../../src/map/picking";
import { actor, assets, flow, graph, place, scenario } from "../example";
import { choose, fill, show } from "../page";

const car = actor("car-1");
const walker = { ...actor("walker"), category: "pedestrian" as const, speed: 1.5 };

test("speeds are entered in km/h and leave in m/s; an empty field is the speed limit", async () => {
  const onEdit = vi.fn();
  const { user, again } = show(<ActorForm actor={car} driverSets={[]} assets={assets} onEdit={onEdit} />);
  expect(screen.getByRole("textbox", { name: "Desired speed" })).toHaveProperty("placeholder", "speed limit");
  await fill(user, "Desired speed", "36");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "change_actor", actor: "car-1", speed: 10 });
  again(<ActorForm actor={{ ...car, speed: 10 }} driverSets={[]} assets={assets} onEdit={onEdit} />);
  await fill(user, "Desired speed", "");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "change_actor", actor: "car-1", speed: null });
});

test("a number beyond its limits is brought within them, and the same number again is no change", async () => {
  const onEdit = vi.fn();
  const { user } = show(<ActorForm actor={car} driverSets={[]} assets={assets} onEdit={onEdit} />);
  await fill(user, "Offset to the left", "9");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "change_actor", actor: "car-1", lateral_offset: 3 });
  await fill(user, "Departs after", "0");
  expect(onEdit).toHaveBeenCalledTimes(1);
});

test("one vehicle is made the ego and released again", async () => {
  const onEdit = vi.fn();
  const { user, again } = show(<ActorForm actor={car} driverSets={[]} assets={assets} onEdit={onEdit} />);
  await user.click(screen.getByRole("checkbox", { name: /ego/i }));
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_ego", actor: "car-1" });
  again(<ActorForm actor={{ ...car, ego: true }} driverSets={[]} assets={assets} onEdit={onEdit} />);
  await user.click(screen.getByRole("checkbox", { name: /ego/i }));
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_ego", actor: null });
});

test("model and driving style are chosen from lists", async () => {
  const onEdit = vi.fn();
  const { user } = show(<ActorForm actor={car} driverSets={["learners"]} assets={assets} onEdit={onEdit} />);
  await choose(user, "Model", "Tesla Model3");
  await choose(user, "Driving style", "Sporty");
  await choose(user, "Driving style", "learners");
  expect(onEdit.mock.calls.map(([edit]) => edit)).toEqual([
    { kind: "change_actor", actor: "car-1", model: "vehicle.tesla.model3" },
    { kind: "change_actor", actor: "car-1", style: "sporty" },
    { kind: "change_actor", actor: "car-1", style: "learners" },
  ]);
});

test("a pedestrian has neither driving style nor ego, but may ignore red lights and cross anywhere", async () => {
  const onEdit = vi.fn();
  const { user } = show(<ActorForm actor={walker} driverSets={[]} assets={assets} onEdit={onEdit} />);
  expect(screen.queryByRole("textbox", { name: "Driving style" })).toBeNull();
  expect(screen.queryByRole("checkbox", { name: /ego/i })).toBeNull();
  expect(screen.getByRole("textbox", { name: "Walking speed" })).toHaveProperty("value", "5.4 km/h");
  await user.click(screen.getByRole("checkbox", { name: "Ignores red lights" }));
  expect(onEdit).toHaveBeenCalledWith({ kind: "change_actor", actor: "walker", ignores_red: true });
  await user.click(screen.getByRole("checkbox", { name: "Crosses the road anywhere" }));
  expect(onEdit).toHaveBeenLastCalledWith({
    kind: "change_actor",
    actor: "walker",
    crosses_anywhere: true,
  });
});

test("several road users show what they share and what differs, and change together", async () => {
  const onChange = vi.fn();
  const { user } = show(
    <ManyForm
      driverSets={[]}
      actors={[
        { ...car, speed: 10 },
        { ...actor("b"), speed: 5 },
      ]}
      onChange={onChange}
    />,
  );
  expect(screen.getByRole("textbox", { name: "Desired speed of all" })).toHaveProperty(
    "placeholder",
    "different",
  );
  expect(screen.getByRole("textbox", { name: "Driving style of all" })).toHaveProperty("value", "Normal");
  await fill(user, "All depart after", "30");
  expect(onChange).toHaveBeenCalledWith({ depart: 30 }, "Departure");
});

test("a flow has vehicles per hour, a mix and a day profile", async () => {
  const onEdit = vi.fn();
  const { user } = show(
    <FlowForm flow={flow("f", "x")} profiles={{ weekday: [1, 4, 2, 3] }} onEdit={onEdit} />,
  );
  await fill(user, "Vehicles per hour", "450");
  await choose(user, "Day profile", "Weekday");
  await fill(user, "Bus", "1");
  expect(onEdit.mock.calls.map(([edit]) => edit)).toEqual([
    { kind: "change_flow", flow: "f", per_hour: 450 },
    { kind: "change_flow", flow: "f", profile: "weekday" },
    { kind: "change_flow", flow: "f", mix: { car: 1, bus: 1 } },
  ]);
});

test("a pedestrian flow has pedestrians per hour and no mix", () => {
  show(<FlowForm flow={{ ...flow("f", "x"), mix: { pedestrian: 1 } }} profiles={{}} onEdit={vi.fn()} />);
  expect(screen.getByRole("textbox", { name: "Pedestrians per hour" })).toHaveProperty("value", "300");
  expect(screen.queryByRole("group", { name: "Mix of road users" })).toBeNull();
});

test("the last kind of a mix stays", async () => {
  const onChange = vi.fn();
  const { user } = show(<MixForm mix={{ car: 1 }} onChange={onChange} />);
  expect(screen.queryByRole("textbox", { name: "Pedestrian" })).toBeNull();
  await fill(user, "Car", "0");
  expect(onChange).not.toHaveBeenCalled();
});

test("background traffic has one amount, in the unit that is chosen", async () => {
  const background: Background = {
    id: "b",
    begin: 0,
    end: null,
    profile: null,
    arrivals: "even",
    mix: { car: 1 },
    fill: null,
    per_km: 5,
    trips: null,
  };
  const onEdit = vi.fn();
  const { user, again } = show(
    <BackgroundForm background={background} profiles={{}} onEdit={onEdit} onRemove={vi.fn()} />,
  );
  await fill(user, "Vehicles per kilometre", "8");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_background", background: "b", per_km: 8 });
  await choose(user, "Amount given as", "Number of trips");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_background", background: "b", trips: 500 });
  again(
    <BackgroundForm
      background={{ ...background, per_km: null, fill: 0.25 }}
      profiles={{}}
      onEdit={onEdit}
      onRemove={vi.fn()}
    />,
  );
  expect(screen.getByRole("textbox", { name: "Density" })).toHaveProperty("value", "25 %");
  await fill(user, "Until", "10");
  expect(onEdit).toHaveBeenLastCalledWith({ kind: "set_background", background: "b", end: 600 });
});

test("a random fill says whom it replaces and passes on density and seed", async () => {
  const onFill = vi.fn();
  const { user, again } = show(<FillForm actors={0} busy={false} onFill={onFill} />);
  expect(screen.queryByText(/replace/)).toBeNull();
  await fill(user, "Random seed", "7");
  await user.click(screen.getByRole("button", { name: "Fill the region" }));
  expect(onFill).toHaveBeenCalledWith(0.3, 7, null);
  again(<FillForm actors={1} busy={false} onFill={onFill} />);
  expect(screen.getByText(/They replace the road user of the scenario; undo restores it\./)).toBeTruthy();
});

test("a generator is chosen with its options, and one that fails says why", async () => {
  const option = { title: "", meaning: "", low: null, high: null, choices: [] };
  vi.spyOn(models, "generators").mockResolvedValue([
    { name: "gone", summary: "", options: [], error: "it cannot be imported" },
    {
      name: "spread",
      summary: "Places cars apart.",
      error: "",
      options: [
        { ...option, name: "apart", kind: "integer", title: "Apart", usual: 12 },
        { ...option, name: "moving", kind: "boolean", title: "They move", usual: false },
      ],
    },
  ]);
  const onFill = vi.fn();
  const { user } = show(<FillForm actors={0} busy={false} onFill={onFill} />);
  await screen.findByText("Placed by");
  await choose(user, "Placed by", "Generator gone");
  expect(screen.getByRole("alert").textContent).toContain("it cannot be imported");
  await choose(user, "Placed by", "Generator spread");
  expect(screen.getByText("Places cars apart.")).toBeTruthy();
  await fill(user, "Apart", "30");
  await user.click(screen.getByRole("checkbox", { name: "They move" }));
  await user.click(screen.getByRole("button", { name: "Fill the region" }));
  const options = { apart: 30, moving: true };
  expect(onFill).toHaveBeenLastCalledWith(0.3, 1, { name: "spread", options });
  await choose(user, "Placed by", "Random");
  await user.click(screen.getByRole("button", { name: "Fill the region" }));
  expect(onFill).toHaveBeenLastCalledWith(0.3, 1, null);
});

test("a new random seed is drawn with a button", async () => {
  const { user } = show(<FillForm actors={0} busy={false} onFill={vi.fn()} />);
  const drawn = vi.spyOn(Math, "random").mockReturnValue(0.5);
  await user.click(screen.getByRole("button", { name: "New random seed" }));
  drawn.mockRestore();
  expect(screen.getByRole("textbox", { name: "Random seed" })).toHaveProperty("value", "50000");
});

test("a duration is shown in the unit that fits and committed in seconds", async () => {
  const onCommit = vi.fn();
  const { user } = show(<Duration label="Duration" seconds={5400} onCommit={onCommit} />);
  expect(screen.getByRole("textbox", { name: "Duration" })).toHaveProperty("value", "90");
  await choose(user, "Duration: unit", "hours");
  await fill(user, "Duration", "2");
  expect(onCommit).toHaveBeenCalledWith(7200);
});

test("start and goal can be set without the map", async () => {
  const document = scenario([car], ["a", "b"]);
  const starts = new Starts(graph, new Picker(graph), insideRows(graph, document.roi), document);
  const [onStart, onGoal, onPickGoal] = [vi.fn(), vi.fn(), vi.fn()];
  const part = (goal: string | null) => (
    <StartAndGoal
      one={{ ...car, goal }}
      graph={graph}
      starts={starts}
      goals={[place("1.0.-1.1")]}
      onStart={onStart}
      onGoal={onGoal}
      onPickGoal={onPickGoal}
      onVia={vi.fn()}
      onPickVia={vi.fn()}
    />
  );
  const { user, again } = show(part(null));
  await user.click(screen.getByRole("button", { name: "Move forward" }));
  expect(onStart).toHaveBeenCalledWith("1.0.-1.1");
  await user.click(screen.getByRole("button", { name: "Move back" }));
  expect(onStart).toHaveBeenCalledTimes(1);
  expect(screen.getByRole("textbox", { name: "Goal" })).toHaveProperty("value", "Random (one of 1)");
  await choose(user, "Goal", "Road 1, right lane 1, 2 m");
  expect(onGoal).toHaveBeenLastCalledWith("1.0.-1.1");
  again(part("1.0.-1.1"));
  await user.click(screen.getByRole("button", { name: "Random goal" }));
  expect(onGoal).toHaveBeenLastCalledWith(null);
  await user.click(screen.getByRole("button", { name: "Choose on the map" }));
  expect(onPickGoal).toHaveBeenCalledOnce();
});

test("places that a route leads through are named in their order, and each can be taken out", async () => {
  const document = scenario([car], ["a", "b"]);
  const starts = new Starts(graph, new Picker(graph), insideRows(graph, document.roi), document);
  const [onVia, onPickVia] = [vi.fn(), vi.fn()];
  const { user } = show(
    <StartAndGoal
      one={{ ...car, via: ["1.0.-1.1", "1.0.-1.0", "1.0.-1.1"] }}
      graph={graph}
      starts={starts}
      goals={[place("1.0.-1.1")]}
      onStart={vi.fn()}
      onGoal={vi.fn()}
      onPickGoal={vi.fn()}
      onVia={onVia}
      onPickVia={onPickVia}
    />,
  );
  const passed = within(screen.getByRole("group", { name: "Waypoints" }));
  const buttons = passed.getAllByRole("button");
  expect(buttons.map((one) => one.getAttribute("aria-label"))).toEqual([
    null,
    "Remove waypoint 1, Road 1, right lane 1, 2 m",
    "Remove waypoint 2, Road 1, right lane 1, 0 m",
    "Remove waypoint 3, Road 1, right lane 1, 2 m",
  ]);
  await user.click(nth(buttons, 3));
  expect(onVia).toHaveBeenCalledWith(["1.0.-1.1", "1.0.-1.0"]);
  await user.click(screen.getByRole("button", { name: "Add a waypoint" }));
  expect(onPickVia).toHaveBeenCalledOnce();
});

test("how long parking places are taken is asked in minutes once cars park", async () => {
  const onEdit = vi.fn();
  const parking = { begin: 0, end: 0, stay: 3600, within: 300 };
  const { user, again } = show(<ParkingForm parking={parking} onEdit={onEdit} />);
  expect(screen.queryByRole("textbox", { name: "A place is taken for" })).toBeNull();
  again(<ParkingForm parking={{ ...parking, end: 0.3 }} onEdit={onEdit} />);
  await fill(user, "A place is taken for", "20");
  await fill(user, "At most away from start or destination, between zones", "150");
  expect(onEdit.mock.calls.map(([edit]) => edit)).toEqual([
    { kind: "set_parking", stay: { kind: "constant", value: 1200 } },
    { kind: "set_parking", within: 150 },
  ]);
  const drawn = { kind: "uniform", low: 300, high: 1200 };
  again(<ParkingForm parking={{ ...parking, end: 0.3, stay: drawn }} onEdit={onEdit} />);
  const field = screen.getByRole("textbox", { name: "A place is taken for" });
  expect(field).toHaveProperty("placeholder", "drawn for each trip");
});

test("a start from which no goal can be reached says so", () => {
  const document = scenario([car], ["a"]);
  const starts = new Starts(graph, new Picker(graph), insideRows(graph, document.roi), document);
  show(
    <StartAndGoal
      one={car}
      graph={graph}
      starts={starts}
      goals={[]}
      onStart={vi.fn()}
      onGoal={vi.fn()}
      onPickGoal={vi.fn()}
      onVia={vi.fn()}
      onPickVia={vi.fn()}
    />,
  );
  expect(screen.getByText(/No goal can be reached from here/)).toBeTruthy();
  const moves = within(screen.getByRole("group", { name: "Move the start" }));
  expect(moves.getAllByRole("button").map((one) => one.textContent)).toEqual([
    "Move back",
    "Move forward",
    "Another lane",
  ]);
});
