// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test } from "vitest";

import type { GraphColumns, MapDetails } from "../../src/api/types";
import { prefer } from "../../src/language/preferences";
import { Graph } from "../../src/map/graph";
import { Picker } from "../../src/map/picking";
import { Crowd, type Frame } from "../../src/run/frames";
import { LightsAhead } from "../../src/run/lightsAhead";
import { limitsOf } from "../../src/run/limits";
import { limitPath, SpeedChart } from "../../src/run/SpeedChart";
import { SCALES, tintOf } from "../../src/run/tint";
import { show } from "../page";

/** A road of 200 m to the east with two lanes; the left one, 4 m north, ends at 100 m. Nodes are 2 m apart. */
function road(): GraphColumns {
  const right = Array.from({ length: 100 }, (_, k) => ({ x: 1 + 2 * k, y: 0, lane: 0 }));
  const left = Array.from({ length: 50 }, (_, k) => ({ x: 1 + 2 * k, y: 4, lane: 1 }));
  const nodes = [...right, ...left];
  const follows = nodes.flatMap(({ lane }, k) => (nodes[k + 1]?.lane === lane ? [k] : []));
  const columns = {
    x: nodes.map(({ x }) => x),
    y: nodes.map(({ y }) => y),
    hdg: nodes.map(() => 0),
    segment: nodes.map(() => 0),
    lane: nodes.map(({ lane }) => lane),
    lane_keys: ["1.0.-1", "1.0.-2"],
    first_node: [0, 100],
    speed_limit: nodes.map(({ x, y }) => (y > 0 ? null : x < 100 ? 10 : 20)),
    edges: {
      source: follows,
      target: follows.map((k) => k + 1),
      relation: follows.map(() => 0),
    },
    segments: [{ id: "r1" }],
    walks: { x: [], lane_keys: [], first_node: [], lane: [] },
  };
  return columns as unknown as GraphColumns;
}
const graph = new Graph(road());
const loaded = { graph, picker: new Picker(graph) };

test("the limit is that of the lane below, in its direction, and unknown where the map has none", () => {
  const limit = limitsOf(loaded);
  expect(limit(50.3, 0.8, 0.1)).toBe(10);
  expect(limit(150, -1, 0)).toBe(20);
  expect(limit(50, 4, 0)).toBeNull();
  expect(limit(50, 0, Math.PI)).toBeNull();
  expect(limit(50, -9, 0)).toBeNull();
});

const path = (x: number, y: number): [number, number][] => [
  [x, y],
  [x + 8, y],
];
/** Two movements of the right lane at 180 m, one of them turns; one of the left lane at its end; a crossing. */
const LIGHT = {
  id: "J",
  names: ["10"],
  green: [],
  signals: [[]],
  paths: [path(180, 0), path(180, 0), path(100, 4), path(40, 0)],
  walks: [false, false, false, true],
} as unknown as MapDetails["lights"][number];

test("the light ahead is that of one's own lane, from 100 m before its stop line", () => {
  const ahead = new LightsAhead(loaded, [LIGHT]);
  const at = (x: number, y: number, state = "rgrG", hdg = 0) => ahead.at(x, y, hdg, () => state);
  expect(at(170, 0)).toBe("permissive");
  expect(at(90, 0)).toBe("permissive");
  expect(at(170, 0, "ryGG")).toBe("yellow");
  expect(at(60, 0)).toBeNull(); // too far, and the crossing is not for vehicles
  expect(at(185, 0)).toBeNull(); // past it
  expect(at(60, 4)).toBe("red");
  expect(at(60, 4, "rrGr")).toBe("green");
  expect(at(170, 0, "rgrG", Math.PI)).toBeNull();
  expect(ahead.at(170, 0, 0, () => undefined)).toBeNull();
});

test("vehicles have the colour of the light ahead, people on foot none", () => {
  const crowd = new Crowd();
  crowd.origin = [100, 0];
  const kinds = ["car", "car", "pedestrian", "car"] as const;
  crowd.introduce(
    kinds.map((category, index) => ({ index, id: `${index}`, category, length: 5, width: 2, ego: false })),
  );
  const rows = [
    [0, 70, 0, 0, 5, 0],
    [1, -40, 4, 0, 5, 0],
    [2, 70, 0, 0, 1, 0],
    [3, -70, 0, 0, 5, 0],
  ];
  const frame: Frame = {
    step: 0,
    time: 0,
    count: 4,
    pace: 1,
    arrived: 0,
    rows: Float32Array.from(rows.flat()),
  };
  const seen = new LightsAhead(loaded, [LIGHT]).learn(frame, crowd, () => "yyrG");
  const { legend } = SCALES().signal;
  const group = tintOf("signal", seen, [0, 1, 2, 3])?.group ?? [];
  expect([...group].map((k) => legend[k])).toEqual(["Yellow", "Red", "No light ahead", "No light ahead"]);
});

test("limits are steps that break where none is known and where one was not there", () => {
  const same = (value: number): number => value;
  const points = [
    { time: 0, speed: 1, limit: 10 },
    { time: 1, speed: 1, limit: 10 },
    { time: 2, speed: 1, limit: 20 },
    { time: 3, speed: 1, limit: null },
    { time: 4, speed: 1, limit: 20 },
    { time: 9, speed: 1, limit: 20 },
  ];
  expect(limitPath(points, same, same, 2)).toBe("M0.0 10.0H1.0H2.0V20.0M4.0 20.0M9.0 20.0");
});

test("the chart of speeds has a round axis in the reader's unit, the limit and the moment", () => {
  const points = [
    { time: 0, speed: 0, limit: 50 / 3.6 },
    { time: 1, speed: 10, limit: 50 / 3.6 },
  ];
  const { again } = show(<SpeedChart name="car-1" points={points} time={1} gap={2} />);
  const words = (): string[] => [...document.querySelectorAll("text")].map((one) => one.textContent);
  expect(words()).toEqual(["0", "20", "40", "60", "km/h", "0:00.0", "0:01.0"]);
  expect(screen.getByRole("figure").textContent).toContain("Limit 50 km/h");
  expect(screen.getByRole("img").getAttribute("aria-label")).toContain("at most 36 km/h");
  prefer({ speed: "mph" });
  again(<SpeedChart name="car-1" points={points} time={0} gap={2} />);
  expect(words()).toEqual(["0", "20", "40", "mph", "0:00.0", "0:01.0"]);
  expect(screen.getByRole("figure").textContent).toContain("Limit 31 mph");
  const [cursor] = document.querySelectorAll(".speed-cursor");
  expect(cursor?.getAttribute("x1")).toBe("24.0");
  prefer({ speed: "km/h" });
});
