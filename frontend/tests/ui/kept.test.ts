// @vitest-environment happy-dom
import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { parseAddress } from "../../src/ui/address";
import { keep, openedWith, parseKept, withKept, write } from "../../src/ui/kept";

beforeEach(() => {
  vi.useFakeTimers();
  location.hash = "#/edit/a%3Fb";
});
afterEach(() => {
  vi.useRealTimers();
});

test("a link leads back to the part of the map, the step, who was chosen and the moment", () => {
  const kept = {
    at: { x: -12.345, y: 1_000_006.5, scale: 3.14159265 },
    step: "rules",
    chosen: ["car-1", "bus & tram, 2"],
    time: 12.34,
  };
  const hash = withKept("#/edit/a%3Fb", kept);
  expect(hash).toContain("at=-12.35,1000006.50,3.1416");
  expect(parseKept(hash)).toEqual({
    ...kept,
    at: { x: -12.35, y: 1_000_006.5, scale: 3.1416 },
    time: 12.3,
  });
  expect(parseAddress(hash)).toEqual({ view: "editor", scenario: "a?b" });
});

test("what is no view, scale or time is left out, and so is a list that is too long", () => {
  expect(parseKept("#/run/s/r?at=1,2&time=x")).toEqual({});
  expect(parseKept("#/run/s/r?at=1,2,-3")).toEqual({});
  expect(parseKept("#/run/s/r")).toEqual({});
  const many = Array.from({ length: 31 }, (_, k) => `car-${k}`);
  expect(withKept("#/edit/s?step=run", { chosen: many })).toBe("#/edit/s");
});

test("the address has the step at once, and all else a little later, without another entry of the history", () => {
  const entries = history.length;
  keep({ step: "rules" });
  keep({ chosen: ["car-1"] });
  expect(location.hash).toBe("#/edit/a%3Fb?step=rules");
  vi.runAllTimers();
  expect(location.hash).toBe("#/edit/a%3Fb?step=rules&chosen=car-1");
  keep({ chosen: [] });
  write();
  expect(location.hash).toBe("#/edit/a%3Fb?step=rules");
  expect(history.length).toBe(entries);
});

test("what one view is to keep does not end up in the address of the next", () => {
  keep({ time: 3 });
  location.hash = "#/run/s/r";
  vi.runAllTimers();
  expect(location.hash).toBe("#/run/s/r");
  keep({ time: 4 });
  keep({ time: 5 });
  vi.runAllTimers();
  expect(location.hash).toBe("#/run/s/r?time=5.0");
});

test("a view that is opened again has what it was left with, and a link what it asks for", () => {
  keep({ step: "rules", at: { x: 10, y: 20, scale: 4 } });
  location.hash = "#/run/a%3Fb/r1";
  dispatchEvent(new Event("hashchange"));
  keep({ time: 3 });
  location.hash = "#/edit/a%3Fb";
  dispatchEvent(new Event("hashchange"));
  expect(parseKept(location.hash)).toEqual({ step: "rules", at: { x: 10, y: 20, scale: 4 } });
  location.hash = "#/edit/a%3Fb?step=run";
  dispatchEvent(new Event("hashchange"));
  expect(parseKept(location.hash)).toEqual({ step: "run" });
  expect(openedWith("#/run/a%3Fb/r2", { at: { x: 10, y: 20, scale: 4 } })).toBe(
    "#/run/a%3Fb/r2?at=10.00,20.00,4",
  );
});
