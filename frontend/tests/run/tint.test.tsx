// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { clustered } from "../../src/map/clusters";
import { FLAG_BRAKE, FLAG_LEFT } from "../../src/map/movingLayer";
import type { ScenePin } from "../../src/map/scene";
import { Crowd, type Frame } from "../../src/run/frames";
import { Legend } from "../../src/run/Legend";
import { MapTools } from "../../src/run/MapTools";
import { Replay } from "../../src/run/replay";
import { SpeedChart, speedPath } from "../../src/run/SpeedChart";
import { SCALES, StoppedDelay, tintOf } from "../../src/run/tint";
import { choose, show } from "../page";

/** Road users by number with their speeds, m/s, and flags. */
const frame = (time: number, ...users: [index: number, speed: number, flags?: number][]): Frame => ({
  step: 0,
  time,
  count: users.length,
  pace: 1,
  arrived: 0,
  rows: Float32Array.from(users.flatMap(([index, speed, flags = 0]) => [index, 0, 0, 0, speed, flags])),
});

test("colours tell speeds from stopped to fast, at the bounds that the legend names", () => {
  const speeds = [0, 0.09, 0.1, 19.9 / 3.6, 20.1 / 3.6, 41 / 3.6, 59 / 3.6, 61 / 3.6];
  const seen = frame(0, ...speeds.map((speed, k): [number, number] => [k, speed]));
  expect([...(tintOf("speed", seen, Array.from(speeds.keys()))?.group ?? [])]).toEqual([
    0, 0, 1, 1, 2, 3, 3, 4,
  ]);
  expect(tintOf("kind", seen, [0])).toBeNull();
  for (const { colors, legend } of Object.values(SCALES())) expect(colors.length).toBe(legend.length);
});

test("brakes come before indicators, and neither is grey", () => {
  const seen = frame(0, [0, 5, FLAG_LEFT | FLAG_BRAKE], [1, 5, FLAG_LEFT], [2, 5]);
  expect([...(tintOf("lamps", seen, [0, 1, 2])?.group ?? [])]).toEqual([2, 1, 0]);
});

test("stopped delay adds up while one is stopped, also when others come and go", () => {
  const delays = new StoppedDelay();
  delays.learn(frame(10, [4, 0], [7, 3]));
  delays.learn(frame(12, [7, 3], [4, 0]));
  const seen = delays.learn(frame(15, [4, 0], [7, 0]));
  expect([...(seen.stopped ?? [])]).toEqual([5, 3]);
  expect([...(delays.learn(frame(16, [4, 8])).stopped ?? [])]).toEqual([5]);
  expect(delays.learn(seen)).toBe(seen);
  expect([...(tintOf("delay", seen, [0, 1])?.group ?? [])]).toEqual([1, 1]);
});

test("who is not introduced has no colour of another", () => {
  const crowd = new Crowd();
  crowd.introduce([{ index: 9, id: "b", category: "van", length: 5, width: 2, ego: false }]);
  const seen = frame(0, [4, 0], [9, 30]);
  const moving = crowd.seen(crowd.arrange(seen, null), seen, null, "speed");
  expect([...(moving.tint?.group ?? [])]).toEqual([4]);
  expect(crowd.speed("b")).toBe(30);
  expect(crowd.speed("a")).toBeNull();
});

const replay = new Replay({
  times: [0, 2, 4, 6],
  first: [0, 1, 3, 5, 6],
  actor: [0, 0, 1, 1, 0, 1],
  x: [0, 0, 0, 0, 0, 0],
  y: [0, 0, 0, 0, 0, 0],
  hdg: [0, 0, 0, 0, 0, 0],
  speed: [5, 0, 1, 1, 0, 3],
  actors: ["a", "b"].map((id) => ({ id, category: "car", length: 5, width: 2, ego: false })),
});

test("a recording knows stopped delays and speeds of all its moments", () => {
  expect([...(replay.at(0).stopped ?? [])]).toEqual([0]);
  expect([...(replay.at(2).stopped ?? [])]).toEqual([2, 0]);
  expect([...(replay.at(4).stopped ?? [])]).toEqual([0, 4]);
  expect(replay.speedsOf("a")).toEqual([
    { time: 0, speed: 5 },
    { time: 2, speed: 0 },
    { time: 4, speed: 0 },
  ]);
  expect(replay.speedsOf("nobody")).toEqual([]);
});

test("who is followed has its speed in words and as a line that breaks where it was not there", () => {
  const points = [
    { time: 0, speed: 10 },
    { time: 1, speed: 5 },
    { time: 9, speed: 5 },
  ];
  const same = (value: number): number => value;
  expect(speedPath(points, same, same, 2)).toBe("M0.0 10.0L1.0 5.0M9.0 5.0");
  const { again } = show(<SpeedChart name="car-1" points={points} time={1.5} gap={2} />);
  expect(screen.getByRole("figure").textContent).toContain("Speed of car-1: 18 km/h");
  again(<SpeedChart name="car-1" points={points} time={6} gap={2} />);
  expect(screen.getByRole("figure").textContent).toContain("Speed of car-1: not on the road");
});

test("what colours say is chosen on the map; a recording has no lamps", async () => {
  const onBy = vi.fn();
  const { user, again } = show(<MapTools by="kind" live lights onBy={onBy} />);
  await choose(user, "Colour by", "Brakes and indicators");
  expect(onBy).toHaveBeenCalledWith("lamps");
  again(<MapTools by="kind" live={false} lights={false} onBy={onBy} />);
  await user.click(screen.getByRole("textbox", { name: "Colour by" }));
  expect(screen.getAllByRole("option").map((one) => one.textContent)).toEqual([
    "Kind",
    "Speed",
    "Stopped delay",
  ]);
  const shown = { categories: new Set(["car"] as const), ego: false, lights: false, lamps: false };
  again(<Legend {...shown} marks={new Set()} by="delay" />);
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([...SCALES().delay.legend]);
});

test("signs that would hide each other are one with their number, but for a rule that is looked at", () => {
  const pin = (x: number, rule?: "strong"): ScenePin => ({
    x,
    y: 0,
    sign: "H",
    text: "",
    ...(rule && { rule }),
  });
  const pins = [pin(1), pin(3), pin(60), pin(2, "strong")];
  const sizes = (scale: number): number[] => clustered(pins, scale).map((one) => one.pins.length);
  expect(sizes(1)).toEqual([2, 1, 1]);
  expect(sizes(0.1)).toEqual([3, 1]);
  expect(sizes(20)).toEqual([1, 1, 1, 1]);
  expect(clustered(pins, 1)[0]).toMatchObject({ x: 2, y: 0 });
});
