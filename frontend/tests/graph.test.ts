import { expect, test } from "vitest";

import type { GraphColumns } from "../src/api/types";
import { tiles, unpack } from "../src/map/drawing";
import { Graph, segmentBounds, strips } from "../src/map/graph";
import { Picker } from "../src/map/picking";

/** Two lanes to the east, four nodes each; the segment changes in the middle. */
function example(): GraphColumns {
  const x = [0, 2, 4, 6, 0, 2, 4, 6];
  return {
    spacing: 2,
    lane_keys: ["1.0.-1", "1.0.-2"],
    lane_types: ["driving", "driving"],
    lane_junctions: [null, null],
    speed_limit: x.map(() => null),
    spawnable: x.map(() => 1),
    first_node: [0, 4, 8],
    lane: [0, 0, 0, 0, 1, 1, 1, 1],
    s: x,
    x,
    y: [0, 0, 0, 0, -3, -3, -3, -3],
    hdg: x.map(() => 0),
    width: x.map(() => 3),
    segment: [0, 0, 1, 1, 0, 0, 1, 1],
    left_lane: [-1, -1, -1, -1, 0, 1, 2, 3],
    right_lane: [4, 5, 6, 7, -1, -1, -1, -1],
    segments: [
      { id: "r1-0", kind: "road", neighbours: [1] },
      { id: "r1-1", kind: "road", neighbours: [0] },
    ],
    edges: { source: [0], target: [1], relation: [0] },
    walks: {
      lane_keys: ["1.0.-3"],
      first_node: [0, 2],
      lane: [0, 0],
      x: [0, 2],
      y: [-6, -6],
      hdg: [0, 0],
      width: [2, 2],
      walkable: [1, 1],
      segment: [0, 0],
      source: [0],
      target: [1],
      kind: [0],
    },
  };
}

test("node names are those of the server", () => {
  const graph = new Graph(example());
  expect(graph.vehiclePlace(5).id).toBe("1.0.-2.1");
  expect(graph.walkPlace(1).id).toBe("ped.1.0.-3.1");
  expect(graph.place("1.0.-1.3")?.x).toBe(6);
  expect(graph.place("9.0.-1.3")).toBeUndefined();
});

test("picking finds the nearest place within reach and no other", () => {
  const picker = new Picker(new Graph(example()));
  const both = { vehicles: true, walks: true };
  expect(picker.place(2.2, -2.6, 1, both)?.id).toBe("1.0.-2.1");
  expect(picker.place(2.2, -5.6, 1, both)?.id).toBe("ped.1.0.-3.1");
  expect(picker.place(2.2, -5.6, 1, { vehicles: true, walks: false })).toBeNull();
  expect(picker.place(50, 50, 3, both)).toBeNull();
});

test("picking stays inside the region", () => {
  const picker = new Picker(new Graph(example()));
  const found = picker.place(2.1, 0, 10, { vehicles: true, walks: false, inside: new Set([1]) });
  expect(found?.id).toBe("1.0.-1.2");
});

test("a segment is found by its lanes", () => {
  const picker = new Picker(new Graph(example()));
  expect(picker.segment(5.9, 1, 5)).toBe(1);
  expect(picker.segment(5.9, 90, 5)).toBeNull();
});

test("every lane gives a strip per segment, as wide as the lane and without gaps", () => {
  const found = strips(example());
  expect(found.map((one) => one.segment)).toEqual([0, 1, 0, 1]);
  const ring = [...(found[0]?.ring ?? [])];
  const xs = ring.filter((_, i) => i % 2 === 0);
  const ys = ring.filter((_, i) => i % 2 === 1);
  expect([Math.min(...xs), Math.max(...xs)]).toEqual([-1, 3]);
  expect([Math.min(...ys), Math.max(...ys)]).toEqual([-1.5, 1.5]);
});

test("bounds of segments hold their nodes", () => {
  expect(segmentBounds(example())).toEqual([
    [0, -3, 2, 0],
    [4, -3, 6, 0],
  ]);
});

test("packed lines are unpacked to metres", () => {
  const lines = unpack({ sizes: [2, 1], steps: [100, 200, 50, -25, -150, 0] });
  expect([...lines.xy]).toEqual([1, 2, 1.5, 1.75, 0, 1.75]);
  expect([...lines.start]).toEqual([0, 2, 3]);
});

test("every line is in exactly one tile", () => {
  const lines = unpack({ sizes: [1, 1, 1], steps: [0, 0, 50_000, 0, -50_000, 10] });
  const found = tiles(lines, 100);
  expect(found.flatMap((tile) => tile.rows).sort()).toEqual([0, 1, 2]);
  expect(found).toHaveLength(2);
});
