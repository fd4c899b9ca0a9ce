// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { LightProgram } from "../../src/api/signals";
import type { SignalNow } from "../../src/signals/cursor";
import { occupancy } from "../../src/signals/occupancy";
import { SignalPanel } from "../../src/signals/SignalPanel";
import { NO_NAMES } from "../../src/map/placeNames";
import { rowsOf, show } from "../page";
import { detector, plan, program } from "./program";

interface More {
  now?: SignalNow;
  occupied?: ReadonlySet<string>;
  onClose?: () => void;
}

const panel = (light: LightProgram, more: More = {}) => {
  const load = () => Promise.resolve(light);
  return (
    <SignalPanel
      junctions={["10"]}
      junction="10"
      places={NO_NAMES}
      onJunction={vi.fn()}
      load={load}
      {...more}
    />
  );
};

test("a program says whose it is, and its cycle, offset and splits", async () => {
  show(panel(program()));
  expect(await screen.findByText("the engineer’s, in this scenario")).toBeTruthy();
  const facts = screen.getAllByRole("definition").map((one) => one.textContent);
  expect(facts.slice(0, 3)).toEqual(["fixed-time", "40 s", "5 s"]);
  expect(rowsOf(screen.getByRole("table", { name: "Splits" }))).toEqual([
    ["1", "15 s", "20 s", "50 %", "K1"],
    ["2", "5 to 25 s", "20 s", "50 %", "–"],
  ]);
  expect(screen.getByText("K2, on call")).toBeTruthy();
  expect(screen.queryByText(/^Now/)).toBeNull();
});

test("in a run the stage that is shown is marked, in words and for screen readers", async () => {
  const now: SignalNow = { time: 107, state: "gr", since: 100, before: "rr", plan: "day" };
  const load = vi.fn(() => Promise.resolve(program()));
  const part = (at: SignalNow) => (
    <SignalPanel
      junctions={["10"]}
      junction="10"
      places={NO_NAMES}
      onJunction={vi.fn()}
      load={load}
      now={at}
    />
  );
  const { again } = show(part(now));
  const stage = (await screen.findByText("stage 1: 15 s")).closest("li");
  expect(stage?.getAttribute("aria-current")).toBe("step");
  expect(stage?.textContent).toContain("now");
  expect(screen.getByText(/^Now/).textContent).toBe("Now: stage 1, for 7 s");
  again(part({ ...now, time: 116, state: "yr", since: 115, before: "gr" }));
  expect(screen.getByText(/^Now/).textContent).toBe("Now: yellow, for 1 s");
  expect(document.querySelector("[aria-current]")).toBeNull();
  again(part({ ...now, time: 118, state: "rr", since: 118, before: "yr" }));
  expect(screen.getByText(/^Now/).textContent).toBe("Now: all red, for 0 s");
  again(part({ ...now, time: 120, state: "GG", since: 119, before: "rr" }));
  expect(screen.getByText(/^Now/).textContent).toBe("Now: green for K1 K2");
  expect(load).toHaveBeenCalledTimes(1);
});

test("plans of the day can be looked at one by one; the one that runs is shown first", async () => {
  const evening = { ...plan, id: "evening", cycle: 60, times: [18.5 * 3600] };
  const now: SignalNow = { time: 1, state: "gr", since: null, before: null, plan: "evening" };
  const { user } = show(panel(program({ plans: [plan, evening] }), { now }));
  const choice = await screen.findByRole("textbox", { name: "Plan of the day" });
  expect(choice).toHaveProperty("value", "evening, from 18:30 (runs now)");
  await user.click(choice);
  await user.click(screen.getByRole("option", { name: "day, from 06:00" }));
  expect(screen.getAllByRole("definition")[1]?.textContent).toBe("40 s");
  expect(document.querySelector("[aria-current]")).toBeNull();
});

test("detectors are listed with place and purpose, and with occupancy where calls were logged", async () => {
  const calls: [number, number][] = [[90, 96]];
  const detectors = [
    detector("J1.D1.0", { calls }),
    detector("J1.D1.1"),
    detector("J1.call.0", { label: "C0", call: true, stages: ["2"] }),
  ];
  const now: SignalNow = { time: 100, state: "gr", since: null, before: null, plan: "day" };
  show(panel(program({ control: "actuated", detectors }), { now }));
  expect(rowsOf(await screen.findByRole("table", { name: "Detectors" }))).toEqual([
    ["D1", "30 m before the stop line, 2 lanes", "prolongs stage 1", "free, 5 % of the last minute"],
    ["C0", "where people wait", "calls stage 2", "free, 0 % of the last minute"],
  ]);
  expect(occupancy([detector("J1.D1.0", { calls })], 92)).toBe("occupied, 3 % of the last minute");
});

test("in a run that is watched detectors are occupied or free, in the table and in the picture", async () => {
  const detectors = [
    detector("J1.D1.0"),
    detector("J1.D1.1"),
    detector("J1.bus.0", { label: "buses", bus: true, length: 79.6 }),
    detector("J1.bus.1", { label: "buses", bus: true, length: 79.6, stages: ["2"] }),
  ];
  const site = `<svg>${detectors.map(({ id }) => `<path data-detector="${id}"/>`).join("")}</svg>`;
  const light = program({ control: "actuated", detectors, site });
  const now: SignalNow = { time: 100, state: "gr", since: null, before: null, plan: null };
  const marked = () =>
    [...document.querySelectorAll<SVGElement>(".occupied")].map((one) => one.dataset.detector);
  const load = () => Promise.resolve(light);
  const part = (occupied: ReadonlySet<string>) => (
    <SignalPanel
      junctions={["10"]}
      junction="10"
      places={NO_NAMES}
      onJunction={vi.fn()}
      load={load}
      now={now}
      occupied={occupied}
    />
  );
  const { again } = show(part(new Set(["J1.D1.1", "J1.bus.1"])));
  const table = await screen.findByRole("table", { name: "Detectors" });
  expect(rowsOf(table)).toEqual([
    ["D1", "30 m before the stop line, 2 lanes", "prolongs stage 1", "occupied"],
    ["buses", "last 80 m before the stop line", "priority in stage 1", "free"],
    ["buses", "last 80 m before the stop line", "priority in stage 2", "occupied"],
  ]);
  expect(marked()).toEqual(["J1.D1.1", "J1.bus.1"]);
  again(part(new Set(["J1.D1.0"])));
  expect(marked()).toEqual(["J1.D1.0"]);
});

test("of areas for buses, which are not logged, a recorded run says so", async () => {
  const detectors = [
    detector("J1.D1.0", { calls: [[90, 101]] }),
    detector("J1.bus.0", { label: "buses", bus: true, length: 80 }),
  ];
  const now: SignalNow = { time: 100, state: "gr", since: null, before: null, plan: "day" };
  show(panel(program({ detectors }), { now }));
  const rows = rowsOf(await screen.findByRole("table", { name: "Detectors" }));
  expect(rows.map((row) => row[3])).toEqual(["occupied, 17 % of the last minute", "not logged"]);
});

test("what the server refuses is said, and Escape closes", async () => {
  const onClose = vi.fn();
  const load = () => Promise.reject(new Error("intergreen of 3 s is too short"));
  const { user } = show(
    <SignalPanel
      junctions={["10"]}
      junction="10"
      places={NO_NAMES}
      onJunction={vi.fn()}
      load={load}
      onClose={onClose}
    />,
  );
  const region = screen.getByRole("region", { name: "Traffic light at Junction 10" });
  expect(await within(region).findByText("intergreen of 3 s is too short")).toBeTruthy();
  expect(document.activeElement).toBe(region);
  await user.keyboard("{Escape}");
  expect(onClose).toHaveBeenCalledTimes(1);
});

test("Escape in the list of junctions closes that list, and the next one the panel", async () => {
  const onClose = vi.fn();
  const load = () => Promise.reject(new Error("no program"));
  const { user } = show(
    <SignalPanel
      junctions={["10", "12"]}
      junction="10"
      places={NO_NAMES}
      onJunction={vi.fn()}
      load={load}
      onClose={onClose}
    />,
  );
  await screen.findByText("no program");
  await user.click(screen.getByRole("textbox", { name: "Junction" }));
  expect(screen.getByRole("option", { name: "Junction 12" })).toBeTruthy();
  await user.keyboard("{Escape}");
  expect(screen.queryByRole("option", { name: "Junction 12" })).toBeNull();
  expect(onClose).not.toHaveBeenCalled();
  await user.keyboard("{Escape}");
  expect(onClose).toHaveBeenCalledTimes(1);
});
