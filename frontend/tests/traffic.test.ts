import { afterEach, expect, test, vi } from "vitest";

import type { Background, Demand } from "../src/api/demand";
import type { FitRow } from "../src/api/runs";
import { unitOf } from "../src/editor/Duration";
import {
  amountOf,
  bringsTraffic,
  exampleTable,
  freeName,
  mixWords,
  peakWords,
  secondsOfDay,
  timeOfDay,
  trafficNote,
} from "../src/editor/demand";
import { createEditorStore } from "../src/editor/store";
import { fileGroups } from "../src/run/files";
import { countMarks, countStations, worstFirst } from "../src/run/fit";
import { BY_LENGTH } from "./example";
import { longClock, span } from "../src/language/moments";
import { bytes, hoursMinutes } from "../src/ui/words";

const empty: Demand = {
  clock: 0,
  zones: [],
  profiles: [],
  inputs: [],
  matrices: [],
  counts: [],
  background: [],
  routes: BY_LENGTH,
  parking: { begin: 0, end: 0, stay: 3600, within: 300 },
};
const background: Background = {
  id: "background",
  begin: 0,
  end: null,
  profile: null,
  arrivals: "even" as const,
  mix: { car: 8, van: 1, bus: 1 },
  fill: null,
  per_km: 5,
  trips: null,
};
const row = (place: string, geh: number, at: number | null = 1): FitRow => ({
  counts: "c",
  place,
  begin: 0,
  end: 900,
  counted: 10,
  modelled: 5,
  geh,
  met: geh <= 5,
  why: "",
  x: at,
  y: at,
});

afterEach(() => vi.unstubAllGlobals());

test("traffic is summed up in a line, and zones or profiles alone bring no road user", () => {
  expect(bringsTraffic({ ...empty, zones: [{ id: "z", segments: ["r1"] }] })).toBe(false);
  expect(trafficNote(empty)).toBe("Who else is on the road?");
  const matrix = {
    id: "m",
    begin: 0,
    end: null,
    profile: null,
    arrivals: "even" as const,
    mix: { car: 1 },
    trips: [
      ["a", "b", 900.4],
      ["b", "a", 99.6],
    ] as Demand["matrices"][0]["trips"],
  };
  const counts = {
    id: "c",
    use: "generate" as const,
    mix: { car: 1 },
    rows: [["r1", 0, 900, 4]] as Demand["counts"][0]["rows"],
  };
  expect(trafficNote({ ...empty, matrices: [matrix], counts: [counts], background: [background] })).toBe(
    "1,000 trips, 1 count, background traffic",
  );
});

test("background traffic has the one amount that is given, and its kinds the largest first", () => {
  expect(amountOf(background).key).toBe("per_km");
  expect(amountOf({ ...background, per_km: null, trips: 9 }).key).toBe("trips");
  expect(mixWords({ van: 1, car: 8, bus: 1 })).toBe("Car 80 %, Van 10 %, Bus 10 %");
});

test("a new part gets a name that nothing else has", () => {
  expect(freeName(empty, "background")).toBe("background");
  expect(
    freeName(
      { ...empty, background: [background], zones: [{ id: "background-2", segments: [] }] },
      "background",
    ),
  ).toBe("background-3");
});

test("times of day are read as they are shown; what is none is refused", () => {
  for (const seconds of [0, 25_500, 86_340]) expect(secondsOfDay(timeOfDay(seconds))).toBe(seconds);
  for (const text of ["", "24:00", "7", "x:10"]) expect(secondsOfDay(text)).toBeNull();
  expect(peakWords([1, 4, 2, 3])).toBe("most trips from 06:00, fewest from 00:00");
});

test("the example of each table has the scenario's own roads and begins when the run does", () => {
  expect(exampleTable("od", empty, ["r8", "r9"])).toBe("from,to,trips\nr8,r9,120\nr9,r8,90\n");
  expect(exampleTable("counts", { ...empty, clock: 25_200 }, ["r8"])).toContain("r8,07:00,07:15,48");
  expect(exampleTable("zones", empty, ["r8"])).toBe("zone,segment\ncentre,r8\n");
});

test("lengths of time are in the unit that one thinks in", () => {
  expect([86_400, 3600, 5400, 60, 90].map(unitOf)).toEqual([3600, 60, 60, 1, 1]);
  expect([50, 3600, 5700].map(hoursMinutes)).toEqual(["1 min", "1 h", "1 h 35 min"]);
  expect(longClock(3725, 86_400)).toBe("1:02:05");
  expect(longClock(65, 600)).toBe("1:05.0");
  expect(span(900, 36_000)).toBe("0:15–10:00 h");
  expect([span(0, 60), span(0, 3600), span(30, 90)]).toEqual(["0–1 min", "0–60 min", "0:30–1:30 min"]);
  expect([1500, 95e6, 2.54e9].map(bytes)).toEqual(["1.5 kB", "95 MB", "2.5 GB"]);
});

test("a place is met only if all of its counts are; the worst counts come first", () => {
  const rows = [row("r1", 2), row("r1", 7), row("r2", 1, 3), row("gone", 9, null)];
  expect(countStations(rows)).toEqual([
    { place: "r1", x: 1, y: 1, met: false },
    { place: "r2", x: 3, y: 3, met: true },
  ]);
  expect(countMarks(rows).map(({ kind }) => kind)).toEqual(["met", "unmet"]);
  expect(worstFirst(rows).map(({ geh }) => geh)).toEqual([9, 7, 2, 1]);
});

test("files of a run are described in plain words, each once", () => {
  const files = [
    "actors.json",
    "figures/network.csv",
    "figures/new.csv",
    "report.html",
    "sumo.log",
    "trajectories/part-0001.parquet",
  ].map((name) => ({ name, size: 1 }));
  const groups = fileGroups(files);
  expect(groups.map(({ title }) => title)).toEqual([
    "To read",
    "Tables",
    "Figures and lists",
    "Recordings",
    "The rest",
  ]);
  expect(groups[1]?.files.map(({ word }) => word)).toEqual([
    "The whole road network over time",
    "figures/new.csv",
  ]);
  expect(groups.flatMap((group) => group.files.map(({ name }) => name)).sort()).toEqual(
    files.map(({ name }) => name).sort(),
  );
});

const answers = (...given: [status: number, body: unknown][]): void => {
  vi.stubGlobal("fetch", () => {
    const [status, body] = given.shift() ?? [500, {}];
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
};
const state = (version: number): object => ({
  name: "s",
  version,
  document: { name: "s", actors: [], flows: [] },
  problems: [],
});

test("a change that is refused is reported where it was asked for, and what follows is still asked", async () => {
  answers([200, state(1)]);
  const store = createEditorStore("s");
  await store.getState().load();
  await expect(store.getState().take(() => Promise.reject(new Error("line 3: no")))).rejects.toThrow(
    "line 3: no",
  );
  expect(store.getState().refusal).toBeNull();
  answers([200, state(2)]);
  await store.getState().edit({ kind: "set_seed", seed: 1 });
  expect(store.getState().scenario?.version).toBe(2);
});
