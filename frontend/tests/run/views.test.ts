// @vitest-environment happy-dom
import { act, renderHook } from "@testing-library/react";
import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { useViews } from "../../src/run/useViews";
import { added, changed, closed, keptOf, openedViews } from "../../src/run/views";
import { parseKept, withKept } from "../../src/ui/kept";

beforeEach(() => {
  vi.useFakeTimers();
  location.hash = "#/run/s/r";
});
afterEach(() => {
  vi.useRealTimers();
});

const PLACE = { x: 10, y: 20, scale: 4 };
const FAR = { x: -3, y: 7.25, scale: 0.5 };

test("a link without views opens one, at the place and with the road user that it names", () => {
  expect(openedViews({}).list).toEqual([
    { id: 0, followed: null, by: "kind", lanes: null, camera: null, begin: null },
  ]);
  expect(openedViews({ at: PLACE, chosen: ["car-1"], by: "delay", lanes: "flow" }).list).toEqual([
    { id: 0, followed: "car-1", by: "delay", lanes: { by: "flow", span: null }, camera: null, begin: PLACE },
  ]);
  // What is no colouring is the plain one, and there are never more views than fit.
  const many = openedViews({ by: "smell", others: [{}, {}, {}] });
  expect(many.list.map(({ by }) => by)).toEqual(["kind", "kind"]);
});

test("a new view shows the same place in the same colours, follows nobody and is the one in use", () => {
  const one = openedViews({ chosen: ["car-1"], by: "speed", lanes: "delay,1,3" });
  const two = added(one, 0, PLACE);
  expect(two.used).toBe(1);
  const lanes = { by: "delay", span: [1, 3] };
  expect(two.list[1]).toEqual({ id: 1, followed: null, by: "speed", lanes, camera: null, begin: PLACE });
  expect(added(two, 0, PLACE)).toBe(two);
});

test("to follow in one view, or to colour it, leaves the other as it is", () => {
  const two = added(openedViews({ chosen: ["car-1"] }), 0, PLACE);
  const other = changed(changed(two, 1, { followed: "bus-2" }), 1, { by: "speed" });
  expect(other.list.map(({ followed, by }) => [followed, by])).toEqual([
    ["car-1", "kind"],
    ["bus-2", "speed"],
  ]);
});

test("the view that is left over becomes the first, and the last one stays", () => {
  const two = added(openedViews({ chosen: ["car-1"] }), 0, PLACE);
  const left = closed(changed(two, 1, { followed: "bus-2" }), 0);
  expect([left.list.length, left.used]).toEqual([1, 1]);
  expect(keptOf(left, new Map([[1, FAR]]))).toEqual({ at: FAR, chosen: ["bus-2"], others: [] });
  expect(closed(left, 1)).toBe(left);
  expect(added(left, 1, null).list.map(({ id }) => id)).toEqual([1, 2]);
});

test("a link keeps how many views there are, what each shows and whom it follows", () => {
  const made = changed(added(openedViews({ chosen: ["a & b"] }), 0, PLACE), 1, {
    followed: "bus, 2",
    by: "speed",
    lanes: { by: "density", span: [2, 5] },
    camera: "seat",
  });
  const hash = withKept("#/run/s/r", keptOf(made, new Map([[0, FAR]])));
  expect(hash).toContain("at2=10.00,20.00,4&");
  const opened = openedViews(parseKept(hash));
  expect(opened.list).toEqual([
    { id: 0, followed: "a & b", by: "kind", lanes: null, camera: null, begin: FAR },
    {
      id: 1,
      followed: "bus, 2",
      by: "speed",
      lanes: { by: "density", span: [2, 5] },
      camera: "seat",
      begin: PLACE,
    },
  ]);
  expect(openedViews(parseKept("#/run/s/r?camera=moon")).list[0]?.camera).toBeNull();
});

test("a view whose place is not known yet is in the link, too", () => {
  const hash = withKept("#/run/s/r", { others: [{}] });
  expect(hash).toBe("#/run/s/r?at2=");
  expect(openedViews(parseKept(hash)).list.length).toBe(2);
});

test("the address has views as they are opened, moved, used and closed", () => {
  const { result } = renderHook(() => useViews({ at: PLACE }));
  const address = (): string => {
    vi.runAllTimers();
    return location.hash;
  };
  act(() => result.current.moved(0, PLACE));
  act(() => result.current.add(0));
  expect(result.current.focus).toEqual({ id: 1 });
  act(() => result.current.moved(1, FAR));
  act(() => result.current.follow(1, "car-1"));
  expect(address()).toBe("#/run/s/r?at=10.00,20.00,4&at2=-3.00,7.25,0.5&chosen2=car-1");
  act(() => result.current.colourLanes(0, { by: "flow", span: null }));
  expect(address()).toContain("&lanes=flow&at2=");
  act(() => result.current.colourLanes(0, null));
  expect(address()).not.toContain("lanes");
  act(() => result.current.use(0));
  expect(result.current.used.id).toBe(0);
  act(() => result.current.close(0));
  expect(result.current.used.id).toBe(1);
  // A map that is gone may report its last place later.
  act(() => result.current.moved(0, PLACE));
  expect(address()).toBe("#/run/s/r?at=-3.00,7.25,0.5&chosen=car-1");
});
