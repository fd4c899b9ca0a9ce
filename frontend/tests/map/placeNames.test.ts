import { i18n } from "@lingui/core";
import { expect, test } from "vitest";

import type { MapNames } from "../../src/api/types";
import { messages } from "../../src/locales/de.po";
import { ApproachNames, NO_NAMES, PlaceNames } from "../../src/map/placeNames";

const ROADS: MapNames["roads"] = [
  { id: "r1", street: "North Street", ends: [{ junction: "j10", street: "East Street" }], side: "north" },
  {
    id: "r2",
    street: "East Street",
    ends: [
      { junction: "j10", street: "North Street" },
      { junction: "j11", street: "" },
    ],
    side: "east",
  },
  { id: "r3", street: "", ends: [{ junction: "j10", street: "" }], side: "west" },
  { id: "r4", street: "East Street", ends: [], side: "" },
  { id: "r5", street: "West Lane", ends: [], side: "" },
];
const NAMES = new PlaceNames({
  junctions: [
    {
      id: "j10",
      streets: ["East Street", "North Street"],
      which: "south-west",
      legs: [
        { segment: "r1", side: "north" },
        { segment: "r2", side: "east" },
        { segment: "r3", side: "west" },
        { segment: "r5", side: "west" },
      ],
    },
    {
      id: "j11",
      streets: [],
      which: "",
      legs: [
        { segment: "r2", side: "west" },
        { segment: "r4", side: "west" },
      ],
    },
  ],
  roads: ROADS,
});
const LANES = [
  { at: "2.0.-1", approach: "r2" },
  { at: "2.0.-2", approach: "r2" },
  { at: "22.0.-2", approach: "r2" },
  { at: "1.0.1", approach: "r1" },
];
const at = (junction: string): ApproachNames =>
  new ApproachNames(NAMES, { junctions: [junction], lanes: LANES });

test("junctions and roads have names of streets, and what tells them apart", () => {
  expect(NAMES.junction("10")).toBe("East Street / North Street (south-west)");
  expect(NAMES.junction("j10")).toBe(NAMES.junction("10"));
  expect(NAMES.junction("j11")).toBe("Junction 11");
  expect(NAMES.place("r1")).toBe("North Street, north of East Street");
  expect(NAMES.place("r2")).toBe("East Street between Junction 11 and North Street");
  expect(NAMES.place("r3")).toBe("Road 3, west of East Street / North Street (south-west)");
  const crossing = NAMES.junction("j10");
  expect(NAMES.place("r1>r2")).toBe(`${crossing}, from the north to the east`);
  expect(NAMES.place("r1>j10>r2")).toBe(NAMES.place("r1>r2"));
  expect(NAMES.place("r2>j10")).toBe(`${crossing}, from the east`);
  expect(NAMES.place("r4>r5")).toBe("r4>r5");
  expect(NAMES.placeWithId("r5")).toBe("West Lane (r5)");
});

test("what has no name is called by its id", () => {
  expect(NO_NAMES.junction("10")).toBe("Junction 10");
  expect(["r1", "12.0.-1", "r1>r2"].map((id) => NO_NAMES.placeWithId(id))).toEqual([
    "r1",
    "12.0.-1",
    "r1>r2",
  ]);
  const approaches = new ApproachNames(NO_NAMES, { junctions: ["10"], lanes: LANES });
  expect(approaches.approach("r1")).toBe("r1");
  expect(["r1 left", "walk r1", "r1>r2", "1.0.1"].map((one) => approaches.movement(one))).toEqual([
    "r1 left",
    "walk r1",
    "r1>r2",
    "1.0.1",
  ]);
});

test("movements are named by the side from which they come and where they turn", () => {
  const one = at("10");
  expect(
    ["r1", "r1 left", "r2 straight", "r1 turnaround", "r1>r2", "r1>j10>r1", "walk r2", "2.0.-1"].map((name) =>
      one.movement(name),
    ),
  ).toEqual([
    "from the north",
    "from the north, left turn",
    "from the east, straight on",
    "from the north, U-turn",
    "from the north to the east",
    "from the north, U-turn",
    "crossing in the east",
    "from the east, lane 1",
  ]);
  expect(one.movements(["r1 left", "r1 right", "r2", "walk r1"])).toBe(
    "from the north: left turn, right turn; from the east; crossing in the north",
  );
});

test("legs on one side are told apart by their streets, and those of one street by their ids", () => {
  expect(at("10").approach("r3")).toBe("from the west (Road 3)");
  expect(at("10").approach("r5")).toBe("from the west (West Lane)");
  expect(at("11").approach("r4")).toBe("from the west (East Street (r4))");
});

test("lanes are numbered from the middle of the road, and named by id where two have one number", () => {
  expect(["1.0.1", "2.0.-1", "2.0.-2", "9.0.-1"].map((lane) => at("10").lane(lane))).toEqual([
    "from the north, lane 1",
    "from the east, lane 1",
    "from the east, lane 2.0.-2",
    "9.0.-1",
  ]);
});

test("names are said in German", () => {
  i18n.loadAndActivate({ locale: "de", messages });
  try {
    expect(NAMES.place("r1")).toBe("North Street, im Norden von East Street");
    expect(at("10").movements(["r1 left", "r1 straight", "r2 right", "r1 turnaround", "walk r1"])).toBe(
      "von Norden: links abbiegen, geradeaus, wenden; von Osten: rechts abbiegen; Überweg im Norden",
    );
    expect(at("10").movement("r1>r2")).toBe("von Norden nach Osten");
    expect(at("10").lane("2.0.-1")).toBe("von Osten, Fahrstreifen 1");
  } finally {
    i18n.loadAndActivate({ locale: "en", messages: {} });
  }
});
