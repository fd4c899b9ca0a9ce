// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { ArrangeForm } from "../../src/editor/ArrangeForm";
import { abreast, evenly, inTurn } from "../../src/editor/arrange";
import type { Actor } from "../../src/api/types";
import { type Body, overlap, Starts } from "../../src/editor/placing";
import { Graph } from "../../src/map/graph";
import { Picker } from "../../src/map/picking";
import { actor, columns, place, scenario } from "../example";
import { fill, show } from "../page";

/** Two lanes of nine nodes each, 2 m apart. */
const rows = Array.from({ length: 18 }, (_, i) => i);
const street = new Graph({
  ...columns,
  lane_keys: ["1.0.-1", "1.0.-2"],
  lane_types: ["driving", "driving"],
  lane_junctions: [null, null],
  first_node: [0, 9, 18],
  lane: rows.map((i) => Number(i >= 9)),
  s: rows.map((i) => 2 * (i % 9)),
  x: rows.map((i) => 2 * (i % 9)),
  y: rows.map((i) => (i >= 9 ? -3 : 0)),
  hdg: rows.map(() => 0),
  width: rows.map(() => 3),
  segment: rows.map(() => 0),
  left_lane: rows.map(() => -1),
  right_lane: rows.map(() => -1),
  speed_limit: [13.9],
  spawnable: rows.map(() => 1),
  segments: [{ id: "a", kind: "road", neighbours: [] }],
});
const cars = [actor("a", "1.0.-1.0"), actor("b", "1.0.-1.1"), actor("c", "1.0.-1.8")];
const startsOf = (actors = cars): Starts =>
  new Starts(street, new Picker(street), new Set([0]), scenario(actors));

test("several start beside the first, each on its own lane; who is in the way is avoided", () => {
  const two = [actor("a", "1.0.-1.6"), actor("b", "1.0.-2.1"), actor("c", "1.0.-2.7")];
  // The nearest is free for one of them, the next for the other, which is nearer already.
  expect(abreast(street, startsOf(two), two)).toEqual([["b", "1.0.-2.6"]]);
  expect(abreast(street, startsOf(two), [])).toEqual([]);
});

test("those between the first and the last of a lane have even distances", () => {
  expect(evenly(street, startsOf(), cars)).toEqual([["b", "1.0.-1.4"]]);
  const other = [...cars.slice(0, 2), actor("c", "1.0.-2.8")];
  expect(evenly(street, startsOf(other), other)).toBeNull();
  expect(evenly(street, startsOf(), cars.slice(0, 2))).toBeNull();
});

test("departures follow one another from the earliest on", () => {
  const late = cars.map((one, k) => ({ ...one, depart: 10 - k }));
  expect(inTurn(late, 2.5)).toEqual([
    ["a", 8],
    ["b", 10.5],
    ["c", 13],
  ]);
});

test("what is arranged is one change each", async () => {
  const onEdit = vi.fn();
  const { user } = show(<ArrangeForm actors={cars} graph={street} starts={startsOf()} onEdit={onEdit} />);
  await user.click(screen.getByRole("button", { name: "Evenly along the lane" }));
  await fill(user, "Depart one after another, every", "3");
  expect(onEdit.mock.calls).toEqual([
    [[{ kind: "move_actor", actor: "b", spawn: "1.0.-1.4" }], "Distribute 3 road users"],
    [
      [
        { kind: "change_actor", actor: "a", depart: 0 },
        { kind: "change_actor", actor: "b", depart: 3 },
        { kind: "change_actor", actor: "c", depart: 6 },
      ],
      "Departures of 3 road users",
    ],
  ]);
});

/** Bodies of 4.5 m by 1.8 m where road users of a street start. */
const bodies = (actors: readonly Actor[]): Map<string, Body> =>
  new Map(
    actors.map(({ id, spawn }) => {
      const { x, y, hdg } = street.place(spawn) ?? { x: 0, y: 0, hdg: 0 };
      return [id, { x, y, hdg, length: 4.5, width: 1.8 }];
    }),
  );

test("a start is where the body has room, and what is copied keeps all, be it further away", () => {
  const ones = [actor("a", "1.0.-1.0"), actor("b", "1.0.-1.4")];
  const starts = new Starts(street, new Picker(street), new Set([0]), scenario(ones), bodies(ones));
  // Without a size the next node is free; with one the other lane is, where no body lies over another.
  expect(starts.near(2, 0, 1, false)?.id).toBe("1.0.-1.1");
  const found = starts.near(2, 0, 1, false, { size: [4.5, 1.8] });
  expect(found?.id).toBe("1.0.-2.1");
  expect(found && starts.beyond(2, 0, 1, found)).toBeCloseTo(3);
  expect(found && starts.shifted(ones, found)).toEqual([
    ["a", "1.0.-2.1"],
    ["b", "1.0.-2.5"],
  ]);
  const apart = [actor("a", "1.0.-1.0"), actor("b", "1.0.-1.8")];
  const far = new Starts(street, new Picker(street), new Set([0]), scenario(apart), bodies(apart));
  // Where the second belongs, 14 m beyond the end of the road, there is nothing.
  expect(far.shifted(apart, street.place("1.0.-2.7") ?? place("1.0.-1.0"))).toEqual([
    ["a", "1.0.-2.7"],
    ["b", "1.0.-1.5"],
  ]);
});

test("bodies lie over each other by their headings, lengths and widths", () => {
  const body = { x: 0, y: 0, hdg: 0, length: 4, width: 2 };
  expect(overlap(body, { ...body, x: 4.4 })).toBe(true); // half a metre is kept free
  expect(overlap(body, { ...body, x: 4.6 })).toBe(false);
  expect(overlap(body, { ...body, y: 3.5 })).toBe(false);
  expect(overlap(body, { ...body, y: 3.3, hdg: Math.PI / 2 })).toBe(true);
});
