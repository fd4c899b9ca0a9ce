// @vitest-environment happy-dom
import { act, renderHook } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, expect, test, vi } from "vitest";

import { prefer } from "../../src/language/preferences";
import { LIGHT } from "../../src/map/colors";
import { drawMeasured, type MeasureMarks } from "../../src/map/measureMarks";
import { MovingLayer } from "../../src/map/movingLayer";
import { writtenPicture } from "../../src/map/svg";
import { useMeasure } from "../../src/map/useMeasure";

const SIZE = { width: 800, height: 600 };
const VIEW = { x: 0, y: 0, scale: 4 };

afterEach(() => {
  prefer({ length: "m" });
  document.body.replaceChildren();
});

const drawn = (marks: MeasureMarks): Document =>
  new DOMParser().parseFromString(
    writtenPicture(SIZE, (context) => drawMeasured(context, VIEW, SIZE, LIGHT, marks)),
    "text/xml",
  );
const words = (picture: Document): string[] =>
  [...picture.querySelectorAll("text[stroke]")].map(({ textContent }) => textContent);
const paths = (picture: Document, wanted: string): string[] =>
  [...picture.querySelectorAll(`path${wanted}`)].map((path) => path.getAttribute("d") ?? "");

const CORNER: MeasureMarks = {
  measured: {
    points: [
      [0, 0],
      [30, 0],
      [30, 40],
    ],
    closed: false,
  },
  pointer: null,
};

test("each side has its length, in the reader's unit, and so has the one to the pointer", () => {
  expect(words(drawn(CORNER))).toEqual(["30.0 m", "40.0 m"]);
  const onward = drawn({ ...CORNER, pointer: [-30, 40] });
  expect(words(onward)).toEqual(["30.0 m", "40.0 m", "60.0 m"]);
  expect(paths(onward, "[stroke-dasharray]")).toEqual(["M520 140L280 140"]);
  prefer({ length: "ft" });
  expect(words(drawn(CORNER))).toEqual(["98.4 ft", "131.2 ft"]);
});

test("an area is filled, with the side that closes it, and nothing leads to the pointer", () => {
  const round = drawn({ measured: { ...CORNER.measured, closed: true }, pointer: [-30, 40] });
  expect(words(round)).toEqual(["30.0 m", "40.0 m", "50.0 m"]);
  expect(paths(round, "[opacity]")).toEqual(["M400 300L520 300L520 140Z"]);
  expect(paths(round, "[stroke-dasharray]")).toEqual([]);
});

test("a side that is shorter than its text has none", () => {
  const marks: MeasureMarks = {
    measured: {
      points: [
        [0, 0],
        [10, 0],
      ],
      closed: false,
    },
    pointer: null,
  };
  expect(words(drawn(marks))).toEqual([]);
});

test("what is measured is in the drawing that is saved, and gone when it is ended", () => {
  const layer = new MovingLayer();
  const saved = (): string =>
    writtenPicture(SIZE, (context) => layer.draw(context, VIEW, SIZE, 1, LIGHT, null));
  layer.measured = CORNER;
  expect(saved()).toContain(">40.0 m</text>");
  layer.measured = null;
  expect(saved()).not.toContain("<path");
});

test("keys in another map, a field or a dialog are not those of the tool; all others end there", async () => {
  document.body.innerHTML = `
    <div role="application" tabindex="0" id="mine"></div>
    <div role="application" tabindex="0" id="other"></div>
    <input id="field" /><div role="dialog"><button id="inside">x</button></div>`;
  const at = (id: string): HTMLElement => document.getElementById(id) as HTMLElement;
  const heard = vi.fn();
  addEventListener("keydown", heard);
  const { result } = renderHook(() => useMeasure({ current: at("mine") }));
  const user = userEvent.setup();
  const press = async (id: string, key: string): Promise<void> => {
    at(id).focus();
    await act(() => user.keyboard(key));
  };
  act(() => result.current.toggle());
  act(() => result.current.add([1, 2], 1));
  act(() => result.current.add([5, 2], 1));
  for (const id of ["other", "field", "inside"]) {
    await press(id, "{Backspace}");
    await press(id, "{Escape}");
  }
  expect(heard).toHaveBeenCalledTimes(6);
  expect(result.current.measured?.points).toHaveLength(2);
  await press("mine", "{Backspace}");
  expect(result.current.measured?.points).toEqual([[1, 2]]);
  await press("mine", "{Escape}");
  expect(result.current.measured).toBeNull();
  expect(result.current.marks).toBeNull();
  expect(heard).toHaveBeenCalledTimes(6);
  await press("mine", "{Backspace}");
  expect(heard).toHaveBeenCalledTimes(7);
  removeEventListener("keydown", heard);
});
