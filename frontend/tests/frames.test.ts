import { expect, test } from "vitest";

import { prefer } from "../src/language/preferences";
import { hasEnded, keyFigures } from "../src/run/figures";
import { FIGURES } from "./figures";
import { Crowd, decodeFrame } from "../src/run/frames";
import { summary } from "./messages";

const frame = (...numbers: number[]): ArrayBuffer => new Float32Array(numbers).buffer;
const two = frame(7, 3.5, 2, 1.25, 4, 11, 100, 200, 1.5, 8, 1, 12, -5, 6, 0, 1, 0);

test("a frame is read as it was sent", () => {
  const found = decodeFrame(two);
  expect(found).toMatchObject({ step: 7, time: 3.5, count: 2, pace: 1.25, arrived: 4 });
  expect([...found.rows.subarray(0, 6)]).toEqual([11, 100, 200, 1.5, 8, 1]);
});

test("an empty road is a frame too", () => {
  expect(decodeFrame(frame(0, 0, 0, 0, 0)).count).toBe(0);
});

test("a frame that does not add up is refused", () => {
  expect(() => decodeFrame(frame(7, 3.5, 2, 1, 4, 11))).toThrow("2 road users");
  expect(() => decodeFrame(new ArrayBuffer(7))).toThrow("7 bytes");
});

test("who has not been introduced is not drawn, the others have their true size", () => {
  const crowd = new Crowd();
  crowd.introduce([
    { index: 12, id: "walker", category: "pedestrian", length: 0.5, width: 0.25, ego: false },
  ]);
  const moving = crowd.arrange(decodeFrame(two), null);
  expect(moving.count).toBe(1);
  expect([...moving.pose.subarray(0, 5)]).toEqual([-5, 6, 0, 0.5, 0.25]);
  expect(moving.category[0]).toBe(6);
  expect(crowd.seen(moving, decodeFrame(two), "walker", "kind").followed).toBe(0);
  expect(moving.ego).toBe(-1);
});

test("who has left the road is followed no more", () => {
  const crowd = new Crowd();
  crowd.introduce([{ index: 11, id: "car-1", category: "car", length: 5, width: 2, ego: true }]);
  expect(crowd.arrange(decodeFrame(two), "car-1").ego).toBe(0);
  expect(crowd.arrange(decodeFrame(frame(8, 4, 0, 1, 5)), "car-1").ego).toBe(-1);
});

test("key figures that a run has not are left out", () => {
  const some = summary({ figures: { mean_speed: 10, mean_delay: null } }, { planned: 3, arrived: 2 });
  expect(keyFigures(some, FIGURES).map(({ label, value }) => [label, value])).toEqual([
    ["Arrived", "2"],
    ["Mean speed", "36.0 km/h"],
  ]);
  expect(keyFigures(summary(), FIGURES)).toEqual([]);
});

test("key figures are in the units of the reader", () => {
  const some = summary({ figures: { mean_speed: 10, mean_delay: null } }, {});
  const speed = (): string | undefined =>
    keyFigures(some, FIGURES).find(({ name }) => name === "mean_speed")?.value;
  prefer({ speed: "mph" });
  expect(speed()).toBe("22.4 mph");
  prefer({ speed: "m/s" });
  expect(speed()).toBe("10.0 m/s");
  prefer({ speed: "km/h" });
  expect(speed()).toBe("36.0 km/h");
});

test("only final states end a run", () => {
  expect((["completed", "stopped", "failed"] as const).every(hasEnded)).toBe(true);
  expect((["preparing", "running", "paused", "finishing"] as const).some(hasEnded)).toBe(false);
});
