import { expect, test } from "vitest";

import type { ConversionReport } from "../src/api/types";
import { coverage, grouped } from "../src/catalogue/conversion";
import { arranged, type Wish } from "../src/catalogue/order";
import { stepWords } from "../src/catalogue/steps";
import { hashOf, parseAddress } from "../src/ui/address";
import { roughLength } from "../src/language/units";
import { clock } from "../src/language/moments";
import { mapFacts, modelWord, networkFact } from "../src/ui/words";
import { mapInfo } from "./example";

type Entry = ConversionReport["entries"][number];

test("maps are found by all words and sorted by name as people count", () => {
  const maps = [mapInfo("Town 10", 3), mapInfo("Town 2", 9), mapInfo("Village", 1)];
  expect(arranged(maps, "town", "name").map((one) => one.name)).toEqual(["Town 2", "Town 10"]);
  expect(arranged(maps, "", "junctions")[0]?.name).toBe("Town 2");
  expect(arranged(maps, "10 town", "name")).toHaveLength(1);
});

test("an address leads back to the same view, whatever the name", () => {
  for (const name of ["plain", "a/b #1 ü %", "100%"]) {
    expect(parseAddress(hashOf({ view: "editor", scenario: name }))).toEqual({
      view: "editor",
      scenario: name,
    });
    expect(parseAddress(hashOf({ view: "run", scenario: name, run: "r1" }))).toEqual({
      view: "run",
      scenario: name,
      run: "r1",
    });
  }
  expect(parseAddress("#/nonsense")).toEqual({ view: "catalogue" });
});

test("figures are said as people say them", () => {
  expect(mapFacts(mapInfo("x", 1).statistics)).toEqual([
    "1.2 km × 800 m",
    "33 km of lanes",
    "1 junction",
    "1 crosswalk",
    "0 traffic lights",
    "limit 50 km/h",
  ]);
  expect(clock(75.04)).toBe("1:15.0");
  expect(roughLength(950)).toBe("950 m");
  expect(modelWord("vehicle.tesla.model3")).toBe("Tesla Model3");
});

test("who wrote the network is said where it is not odscen", () => {
  expect(networkFact({ converter: "odscen", source: null })).toEqual([]);
  expect(networkFact({ converter: "netconvert", source: null })).toEqual(["network by netconvert"]);
  expect(networkFact({ converter: "file", source: "a.net.xml" })).toEqual(["network from a.net.xml"]);
});

test("only maps that have all that is wished for are shown", () => {
  const [left, lit] = [mapInfo("left", 2), mapInfo("lit", 0)];
  left.statistics.rule = "LHT";
  lit.statistics.traffic_lights = 4;
  const names = (...wishes: Wish[]): string[] =>
    arranged([left, lit], "", "name", wishes).map((one) => one.name);
  expect(names()).toEqual(["left", "lit"]);
  expect(names("left")).toEqual(["left"]);
  expect(names("lights", "crosswalks")).toEqual(["lit"]);
  expect(names("lights", "junctions")).toEqual([]);
  expect(names("small")).toEqual([]);
});

test("a conversion report says the same of many places once, what was lost first", () => {
  const entry = (fate: Entry["fate"], element: string, reason: string): Entry => ({
    fate,
    element,
    reason,
    confidence: null,
    source_id: null,
  });
  const report = {
    counts: {},
    figures: {
      driving_road_length: 300,
      driving_road_covered: 299.9,
      driving_junction_length: 100,
      driving_junction_covered: 100,
    },
    entries: [
      entry("kept", "road 1 > object 3", "crosswalk, as a crossing of its place and width"),
      entry("lost", "road 1", "lanes of type shoulder are open to nobody and left out"),
      entry("lost", "road 2", "lanes of type shoulder are open to no road user and left out"),
      entry("lost", "road 9", "SUMO knows no such thing"),
    ],
  };
  expect(grouped(report)).toEqual([
    {
      outcome: "lost",
      title: "Could not be used",
      findings: [
        {
          text: "Lanes of the kind “shoulder” are not driven on and are left out",
          places: ["road 1", "road 2"],
        },
        { text: "The simulation knows no such thing", places: ["road 9"] },
      ],
    },
    {
      outcome: "kept",
      title: "Imported unchanged",
      findings: [{ text: "Crosswalks, with place and width", places: ["road 1 > object 3"] }],
    },
  ]);
  expect(coverage(report)).toEqual({ driving: 99, walking: null });
});

test("steps of a job are reported in plain words, with the map's name if there are several", () => {
  expect(stepWords("making the SUMO network")).toBe("Step 3 of 4: preparing the simulation");
  expect(stepWords("town: comparing the SUMO network with the map")).toBe(
    "town, step 4 of 4: comparing the simulation with the map",
  );
  expect(stepWords("waiting")).toBe("Waiting");
});

test("a place in a map of another format has its id there, and how sure the importer is", () => {
  const entry = { fate: "guessed", element: "road 1", reason: "a width of 3.5 m" } as const;
  const entries = [
    { ...entry, confidence: 0.456, source_id: "way/7" },
    { ...entry, confidence: null, source_id: "way/8" },
  ];
  expect(grouped({ counts: {}, figures: {}, entries })[0]?.findings[0]?.places).toEqual([
    "road 1, way/7, 46 % sure",
    "road 1, way/8",
  ]);
});
