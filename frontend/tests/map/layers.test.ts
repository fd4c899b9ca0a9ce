// @vitest-environment happy-dom
import { i18n } from "@lingui/core";
import { afterEach, expect, test } from "vitest";

import { prefer } from "../../src/language/preferences";
import { gridLines } from "../../src/map/gridLayer";
import { LIGHT } from "../../src/map/colors";
import { FIRST_LAYERS, type MapLayers, readLayers, showLayer, useMapLayers } from "../../src/map/mapLayers";
import { roomFor, segmentNames } from "../../src/map/namesLayer";
import { EMPTY_SCENE } from "../../src/map/scene";
import { SceneLayer } from "../../src/map/sceneLayer";
import { writtenPath, writtenPicture } from "../../src/map/svg";
import { toScreen } from "../../src/map/view";
import { graph } from "../example";

afterEach(() => {
  i18n.loadAndActivate({ locale: "en", messages: {} });
  prefer({ length: "m" });
  useMapLayers.setState(FIRST_LAYERS);
  localStorage.clear();
});

const SIZE = { width: 800, height: 600 };

test.each([0.013, 0.4, 1, 3.7, 80])(
  "at %d pixels a metre the grid has round lines that are not crowded",
  (scale) => {
    const view = { x: 123.4, y: -56.7, scale };
    const { x, y } = gridLines(view, SIZE);
    for (const lines of [x, y]) {
      const gaps = lines.slice(1).map(({ at }, n) => Math.abs(at - (lines[n]?.at ?? 0)));
      expect(Math.min(...gaps)).toBeGreaterThanOrEqual(69.9);
      expect(Math.max(...gaps)).toBeLessThanOrEqual(70 * 2.5 + 0.1);
    }
    for (const { at, text } of x) expect(toScreen(view, SIZE, Number(text), 0)[0]).toBeCloseTo(at, 6);
    for (const { at, text } of y) expect(toScreen(view, SIZE, 0, Number(text))[1]).toBeCloseTo(at, 6);
  },
);

test("a reader of feet has lines at round feet", () => {
  prefer({ length: "ft" });
  const view = { x: 0, y: 0, scale: 2 };
  const { x, unit } = gridLines(view, SIZE);
  expect(unit).toBe("ft");
  expect(x.map(({ text }) => Math.abs(Number(text) % 200))).toEqual(x.map(() => 0));
  const third = x[2];
  expect(third?.at).toBeCloseTo(toScreen(view, SIZE, Number(third?.text) * 0.3048, 0)[0], 6);
});

test("coordinates are written as the reader writes numbers, and the origin has no sign", () => {
  const near = { x: 0, y: 0, scale: 80 };
  expect(gridLines(near, SIZE).x.map(({ text }) => text)).toEqual([
    "-5",
    "-4",
    "-3",
    "-2",
    "-1",
    "0",
    "1",
    "2",
    "3",
    "4",
    "5",
  ]);
  const tenths = gridLines({ ...near, scale: 200 }, SIZE).x.map(({ text }) => text);
  expect(tenths).toContain("0.5");
  i18n.loadAndActivate({ locale: "de", messages: {} });
  expect(gridLines({ ...near, scale: 200 }, SIZE).x.map(({ text }) => text)).toEqual(
    tenths.map((text) => text.replace(".", ",")),
  );
});

test("each segment is named once, on one of its nodes, and no name lies on another", () => {
  const { columns } = graph;
  const names = segmentNames(graph);
  const rows = new Set(columns.segment);
  expect(names.map(({ text }) => text).sort()).toEqual([...rows].map((row) => graph.segmentId(row)).sort());
  for (const { x, y } of names) {
    expect([...columns.x].some((each, node) => each === x && columns.y[node] === y)).toBe(true);
  }
  const [first] = names;
  const view = { x: first?.x ?? 0, y: first?.y ?? 0, scale: 40 };
  const seen = roomFor([...names, ...names], view, SIZE, () => 30);
  expect(seen[0]?.text).toBe(first?.text);
  expect(new Set(seen.map(({ text }) => text)).size).toBe(seen.length);
  expect(roomFor(names, { ...view, scale: 0.001 }, SIZE, () => 30)).toEqual([]);
});

test("the grid and the names are in the drawing that is saved, where they are shown", () => {
  const view = { x: graph.columns.x[0] ?? 0, y: graph.columns.y[0] ?? 0, scale: 40 };
  const [first] = segmentNames(graph);
  const near = { ...view, x: first?.x ?? 0, y: first?.y ?? 0 };
  const drawn = (layers: MapLayers): string =>
    writtenPicture(SIZE, (context) =>
      new SceneLayer(graph, null, writtenPath).draw(context, near, SIZE, 1, LIGHT, EMPTY_SCENE, layers),
    );
  expect(drawn(FIRST_LAYERS)).not.toContain("<text");
  expect(drawn({ ...FIRST_LAYERS, names: true })).toContain(`>${first?.text}</text>`);
  const grid = drawn({ ...FIRST_LAYERS, grid: true });
  for (const { text } of gridLines(near, SIZE).x.slice(1, -1)) expect(grid).toContain(`>${text}</text>`);
});

test("layers are remembered, and what is kept and not known any more is as at first", () => {
  showLayer("grid", true);
  showLayer("signs", false);
  expect(readLayers(localStorage.getItem("odscen.layers"))).toEqual({
    ...FIRST_LAYERS,
    grid: true,
    signs: false,
  });
  for (const text of [null, "", "[1", "null", '{"grid": "yes", "gone": true}']) {
    expect(readLayers(text)).toEqual(FIRST_LAYERS);
  }
});
