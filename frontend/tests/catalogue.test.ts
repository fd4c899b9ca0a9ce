import { expect, test } from "vitest";

import type { MapInfo } from "../src/api/types";
import { arranged } from "../src/catalogue/order";
import { hashOf, parseRoute } from "../src/ui/route";
import { clock, length, mapFacts, modelWord } from "../src/ui/words";

const map = (name: string, junctions: number): MapInfo => ({
  name, sha256: "", graph: {}, report_counts: null, preview: "",
  statistics: {
    bounds: [0, 0, 1200, 800], road_length: 1, driving_lane_length: 33_345, roads: 1, junctions,
    crosswalks: 1, traffic_lights: 0, stop_signs: 0, speed_limit_min: 13.9, speed_limit_max: 13.9, rule: "RHT",
  },
});

test("maps are found by all words and sorted by name as people count", () => {
  const maps = [map("Town 10", 3), map("Town 2", 9), map("Village", 1)];
  expect(arranged(maps, "town", "name").map((one) => one.name)).toEqual(["Town 2", "Town 10"]);
  expect(arranged(maps, "", "junctions")[0].name).toBe("Town 2");
  expect(arranged(maps, "10 town", "name")).toHaveLength(1);
});

test("an address leads back to the same view, whatever the name", () => {
  for (const name of ["plain", "a/b #1 ü %", "100%"]) {
    expect(parseRoute(hashOf({ view: "editor", scenario: name }))).toEqual({ view: "editor", scenario: name });
    expect(parseRoute(hashOf({ view: "run", scenario: name, run: "r1" }))).toEqual({ view: "run", scenario: name, run: "r1" });
  }
  expect(parseRoute("#/nonsense")).toEqual({ view: "catalogue" });
});

test("figures are said as people say them", () => {
  expect(mapFacts(map("x", 1).statistics)).toEqual(
    ["1.2 km × 800 m", "33 km of lanes", "1 junction", "1 crosswalk", "0 traffic lights", "limit 50 km/h"]);
  expect(clock(75.04)).toBe("1:15.0");
  expect(length(950)).toBe("950 m");
  expect(modelWord("vehicle.tesla.model3")).toBe("Tesla Model3");
});
