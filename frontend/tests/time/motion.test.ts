import { expect, test } from "vitest";

import type { Incident } from "../../src/api/runs";
import { Crowd, type Frame } from "../../src/run/frames";
import { bandsOf, shownWords } from "../../src/time/bands";
import { type Body, linePath, nearestOf, timeToCollision } from "../../src/time/collision";
import { firingsOf, neighbour, nearestIncident, thinnedMarks } from "../../src/time/fired";
import { Planned } from "../../src/time/planned";

const body = (x: number, y: number, hdg: number, speed: number): Body => ({
  x,
  y,
  hdg,
  speed,
  length: 5,
  width: 2,
});

test("who is planned is between two points by the time, and only there while it is on the road", () => {
  const planned = new Planned({
    users: [
      { id: "a", category: "car", length: 4, width: 2, ego: false, flow: null },
      { id: "f.0", category: "bus", length: 12, width: 2.5, ego: true, flow: "f" },
    ],
    first: [0, 3, 5],
    time: [2, 4, 14, 10, 20],
    x: [0, 10, 10, 50, 50],
    y: [0, 0, 100, 0, -20],
    hdg: [0, 0, Math.PI / 2, 3, -3],
    left_out: [],
    not_planned: 0,
  });
  expect([...planned.durations]).toEqual([
    ["a", 12],
    ["f.0", 10],
  ]);
  expect([planned.there(1), planned.there(12), planned.there(15)]).toEqual([[], ["a", "f"], ["f"]]);
  const now = planned.at(12, "f");
  expect([...now.pose.slice(0, 5)].map((v) => Number(v.toFixed(6)))).toEqual([10, 80, 1.256637, 4, 2]);
  // Headings turn the short way round.
  expect(now.pose[7]).toBeCloseTo(3 + 0.2 * (2 * Math.PI - 6), 9);
  expect([now.count, now.ego, now.followed]).toEqual([2, 1, 1]);
  expect(planned.at(3, null).pose[0]).toBe(5);
});

test("time to collision is the gap over the speed at which it closes, of bodies that meet at all", () => {
  expect(timeToCollision(body(0, 0, 0, 15), body(35, 0, 0, 5))).toBeCloseTo(3);
  expect(timeToCollision(body(35, 0, 0, 5), body(0, 0, 0, 15))).toBeCloseTo(3);
  expect(timeToCollision(body(0, 0, 0, 5), body(35, 0, 0, 15))).toBeNull();
  // In the next lane, and behind what is seen.
  expect(timeToCollision(body(0, 0, 0, 15), body(35, 3.5, 0, 5))).toBeNull();
  expect(timeToCollision(body(0, 0, 0, 15), body(105, 0, 0, 5))).toBeNull();
  // Crossing: the side of one is reached after 20 - 1 - 2.5 m at 5 m/s, when the other is still there.
  expect(timeToCollision(body(0, 0, 0, 5), body(20, -16.5, Math.PI / 2, 5))).toBeCloseTo(3.3);
  expect(timeToCollision(body(0, 0, 0, 5), body(20, -40, Math.PI / 2, 5))).toBeNull();
  expect(timeToCollision(body(0, 0, 0, 1), body(3, 0, 0, 1))).toBe(0);
});

test("of all others the one that would be met first counts", () => {
  const crowd = new Crowd();
  const known = { category: "car" as const, length: 5, width: 2, ego: false };
  crowd.introduce(["ego", "near", "far"].map((id, index) => ({ ...known, id, index, ego: index === 0 })));
  const rows = new Float32Array([0, 0, 0, 0, 15, 0, 1, 35, 0, 0, 5, 0, 2, 45, 0, 0, 0, 0]);
  const frame: Frame = { step: 0, time: 7, count: 3, pace: 0, arrived: 0, rows };
  const found = nearestOf(frame, crowd, "ego");
  expect(found?.other).toBe("far");
  expect(found?.ttc).toBeCloseTo(40 / 15);
  expect(nearestOf(frame, crowd, "nobody")).toBeNull();
  const points = [
    { time: 0, ttc: 6, other: "a" },
    { time: 1, ttc: 3, other: "a" },
    { time: 2, ttc: null, other: null },
    { time: 3, ttc: 0, other: "a" },
  ];
  expect(linePath(points, (time) => 10 * time, 30, 1)).toBe("M0.0 0.0h1L10.0 15.0M30.0 30.0h1");
});

test("movements of a light that show the same are one band", () => {
  const bands = bandsOf({ times: [0, 10, 13], states: ["GGr", "yyr", "rrG"] }, 20);
  expect(bands.map(({ movements }) => movements)).toEqual([2, 1]);
  expect(bands[0]?.spans).toEqual([
    { begin: 0, end: 10, shown: "green" },
    { begin: 10, end: 13, shown: "yellow" },
    { begin: 13, end: 20, shown: "red" },
  ]);
  expect(bands[1]?.spans.map(({ begin, shown }) => [begin, shown])).toEqual([
    [0, "red"],
    [13, "green"],
  ]);
  expect(shownWords(bands, 11)).toBe("2 yellow, 1 red");
});

const at = (time: number, kind: Incident["kind"], rule?: string): Incident => ({
  time,
  kind,
  actor: "a",
  ...(rule !== undefined && { rule }),
});
const INCIDENTS = [
  at(3, "rule_started", "r"),
  at(5, "rule_ended", "r"),
  at(5.2, "collision"),
  at(9, "rule_started", "r"),
];

test("rules fire from when to when, and events have a next and a nearest one", () => {
  expect(firingsOf(INCIDENTS)).toEqual([
    { rule: "r", begin: 3, end: 5 },
    { rule: "r", begin: 9, end: null },
  ]);
  expect(neighbour(INCIDENTS, 5, 1)?.time).toBe(5.2);
  expect(neighbour(INCIDENTS, 5, -1)?.time).toBe(3);
  expect(neighbour(INCIDENTS, 9, 1)).toBeNull();
  expect(nearestIncident(INCIDENTS, 5.3, 1)?.kind).toBe("collision");
  expect(nearestIncident(INCIDENTS, 7, 1)).toBeNull();
  expect(thinnedMarks(INCIDENTS, 3).map(({ time }) => time)).toEqual([3, 5.2, 9]);
});
