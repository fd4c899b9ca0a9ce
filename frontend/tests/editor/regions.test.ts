import { expect, test } from "vitest";

import { inBounds } from "../../src/map/areas";
import { extension, rowsWithin } from "../../src/editor/regions";
import { Graph } from "../../src/map/graph";
import { columns } from "../example";

/** Segments a, b and c in a row and d, which touches none of them. */
const town = new Graph({
  ...columns,
  segments: (
    [
      ["a", [1]],
      ["b", [0, 2]],
      ["c", [1]],
      ["d", []],
    ] as const
  ).map(([id, neighbours]) => ({ id, kind: "road", neighbours: [...neighbours] })),
});
const ALL = [0, 1, 2, 3];

test("a rectangle takes the segments that lie in it by half or more", () => {
  const long = new Graph({ ...columns, segment: [0, 0, 1] });
  expect(rowsWithin(long, inBounds([-1, -1, 1, 1]))).toEqual([0]);
  expect(rowsWithin(long, inBounds([1, -1, 5, 1]))).toEqual([0, 1]);
  const three = new Graph({ ...columns, segment: [0, 0, 0] });
  expect(rowsWithin(three, inBounds([3, -1, 5, 1]))).toEqual([]);
});

test("a region is extended by what hangs together with it, nearest first, and the rest is counted", () => {
  expect(extension(town, ["a"], ALL)).toEqual({ segments: ["b", "c"], left: 1 });
  expect(extension(town, ["a"], [0, 2])).toEqual({ segments: [], left: 1 });
  expect(extension(town, ["a", "b"], [0, 1])).toEqual({ segments: [], left: 0 });
});

test("with no region yet the largest part that hangs together is taken", () => {
  expect(extension(town, [], ALL)).toEqual({ segments: ["a", "b", "c"], left: 1 });
  expect(extension(town, [], [3, 0])).toEqual({ segments: ["d"], left: 1 });
  expect(extension(town, [], [])).toEqual({ segments: [], left: 0 });
});
