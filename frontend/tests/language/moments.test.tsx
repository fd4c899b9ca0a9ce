// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { afterEach, expect, test, vi } from "vitest";

import { WindowFields } from "../../src/editor/DemandParts";
import { clock, countFrom, readMoment, shortClock, span } from "../../src/language/moments";
import { prefer } from "../../src/language/preferences";
import { Chart } from "../../src/run/Chart";
import { ticksOf } from "../../src/time/sight";
import { fill, show } from "../page";

const HOUR = 3600;
const START = 9 * HOUR + 45 * 60;

afterEach(() => {
  countFrom(0);
  prefer({ hours: 24 });
});

test("a time of day that is typed is that many seconds after a start at 9:45", () => {
  countFrom(START, 2 * HOUR);
  expect(readMoment("10:00", "min")).toBe(900);
  expect(readMoment("10:00:30", "s")).toBe(930);
  expect(readMoment("10:00 am", "min")).toBe(900);
  expect(readMoment("15 min", "s")).toBe(900);
  expect(readMoment("15", "min")).toBe(900);
  expect(readMoment("", "min")).toBeNull();
  expect(readMoment("9:30", "min")).toBe("Before the start at 09:45");
  expect(readMoment("10:75", "min")).toBe("A time such as 10:00, or 15 min");
});

test("a run that goes on after midnight has the early hours of the next day", () => {
  countFrom(23 * HOUR, 4 * HOUR);
  expect(readMoment("1:30", "min")).toBe(2.5 * HOUR);
  expect(readMoment("4:00", "min")).toBe("Before the start at 23:00");
  expect(clock(2.5 * HOUR)).toBe("01:30:00");
});

test("without a clock minutes and seconds are minutes and seconds, not a number of 1000", () => {
  expect(readMoment("10:00", "min")).toBe(600);
  expect(readMoment("1:10:05", "s")).toBe(4205);
  expect(readMoment("7,5", "min")).toBe(450);
  expect(readMoment("soon", "min")).toBe("A number, such as 15 min");
  expect(readMoment("10:00 am", "min")).toBe("Set the time of day at the start first, in “Demand”");
  expect(clock(75.04)).toBe("1:15.0");
});

test("moments are shown as times of day, in the hours of the reader", () => {
  countFrom(START);
  expect(clock(900)).toBe("10:00:00");
  expect(clock(12.34)).toBe("09:45:12.3");
  expect(shortClock(900, 1800)).toBe("10:00");
  expect(span(900, 1800)).toBe("10:00–10:15");
  prefer({ hours: 12 });
  expect(clock(4 * HOUR)).toBe("1:45:00 PM");
});

test("a closure from 10:00 begins 900 s after a start at 9:45", async () => {
  countFrom(START, HOUR);
  const onChange = vi.fn();
  const { user } = show(<WindowFields begin={0} end={null} onChange={onChange} />);
  expect(screen.getByRole("textbox", { name: "From" })).toHaveProperty("value", "09:45");
  await fill(user, "From", "10:00");
  expect(onChange).toHaveBeenLastCalledWith({ begin: 900 });
  await fill(user, "Until", "9:15");
  expect(screen.getByText("Before the start at 09:45")).toBeTruthy();
  expect(onChange).toHaveBeenCalledTimes(1);
  await user.click(screen.getByRole("textbox", { name: "From" }));
  await user.keyboard("{ArrowUp}");
  expect(onChange).toHaveBeenLastCalledWith({ begin: 60 });
});

test("ticks of a time bar are at round times of day", () => {
  countFrom(START + 60);
  const ticks = ticksOf({ begin: 0, seconds: 1800, width: 600 });
  expect(ticks.map((one) => shortClock(one, 1800))).toEqual([
    "09:50",
    "09:55",
    "10:00",
    "10:05",
    "10:10",
    "10:15",
  ]);
});

test("a chart over time has times of day at its ticks and in its table", () => {
  countFrom(START);
  show(
    <Chart
      title="Arrivals"
      moments
      xLabel="Time of day"
      yLabel="Arrived"
      x={[0, 900, 1800]}
      series={[{ name: "Arrived", color: "red", values: [0, 4, 9] }]}
    >
      How to read it.
    </Chart>,
  );
  expect(screen.getAllByText("10:00").length).toBe(2);
  expect(screen.queryByText("900")).toBeNull();
});
