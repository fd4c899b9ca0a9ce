// @vitest-environment happy-dom
import { act, renderHook, screen, waitFor } from "@testing-library/react";
import { useState } from "react";
import { afterEach, expect, test, vi } from "vitest";

import type { RunLanes } from "../../src/api/runs";
import { prefer } from "../../src/language/preferences";
import { LIGHT } from "../../src/map/colors";
import { FIRST_LAYERS } from "../../src/map/mapLayers";
import { Picker } from "../../src/map/picking";
import { EMPTY_SCENE } from "../../src/map/scene";
import { SceneLayer } from "../../src/map/sceneLayer";
import { writtenPath, writtenPicture } from "../../src/map/svg";
import { LaneTools } from "../../src/run/LaneTools";
import {
  boundsOf,
  classOf,
  type LaneSight,
  laneSight,
  laneSightText,
  LaneUse,
  sequential,
  valueText,
  wordsOf,
} from "../../src/run/laneUse";
import { Legend } from "../../src/run/Legend";
import { type ShownUse, useLaneData, useLaneUse } from "../../src/run/useLaneUse";
import { graph } from "../example";
import { choose, server, show } from "../page";

afterEach(() => prefer({ speed: "km/h", length: "m" }));

/** A lane of 100 m and one of 50 m, over two intervals of a minute; on the second nobody drove at first. */
const LANES: RunLanes = {
  times: [0, 60, 120],
  first: [0, 1, 3],
  lane: [0, 0, 1],
  distance: [600, 200, 0],
  seconds: [60, 40, 30],
  time_loss: [12, 20, 30],
  lengths: [100, 50],
  node_first: [0, 2],
  node_end: [2, 3],
  node_lane: [0, 1],
};
const use = new LaneUse(LANES);
const rounded = (values: Float64Array): number[] => [...values].map((value) => Number(value.toFixed(6)));

test("speed, delay, density and flow of lanes are those of Edie, over the whole run and a part of it", () => {
  expect(rounded(use.values("speed"))).toEqual([28.8, 0]);
  expect(rounded(use.values("delay"))).toEqual([40, Infinity]);
  expect(rounded(use.values("density"))).toEqual([8.333333, 5]);
  expect(rounded(use.values("flow"))).toEqual([240, 0]);
  expect(rounded(use.values("speed", 0, 1))).toEqual([36, NaN]);
  expect(rounded(use.values("flow", 1, 2))).toEqual([120, 0]);
  // Flow is density times speed.
  expect((use.values("density")[0] ?? 0) * (use.values("speed")[0] ?? 0)).toBeCloseTo(240, 9);
});

test("values are in the units of the reader", () => {
  prefer({ speed: "mph", length: "ft" });
  expect(use.values("speed")[0]).toBeCloseTo(17.8955, 4);
  expect(use.values("delay")[0]).toBeCloseTo(40 * 1.609344, 6);
  expect(valueText("density", use.values("density")[0] ?? 0)).toBe("13.4 veh/mi");
});

test("colours begin at round bounds, those of most lanes, and the legend names each of them", () => {
  const values = Float64Array.from([...Array.from({ length: 99 }, (_, n) => n), 5000, NaN, Infinity]);
  const bounds = boundsOf(values);
  expect(bounds).toEqual([20, 40, 60, 80]);
  expect([NaN, 0, 19.9, 20, 79, 80, Infinity].map((value) => classOf(bounds, value))).toEqual([
    null,
    ...[0, 0, 1, 3, 4, 4],
  ]);
  expect(wordsOf("delay", bounds)).toEqual([
    "Below 20 s/km",
    "20 to 40 s/km",
    "40 to 60 s/km",
    "60 to 80 s/km",
    "80 s/km and more",
  ]);
});

test("the scale is the one of Matplotlib, and grows lighter from colour to colour", () => {
  expect(sequential(5)).toEqual(["#482878", "#31688e", "#1f9e89", "#6dcd59", "#fde725"]);
  expect(sequential(1)).toEqual(["#482878"]);
  for (const count of [2, 3, 4, 6]) {
    const light = sequential(count).map((hex) => {
      const [r, g, b] = [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
      return 0.2126 * (r ?? 0) + 0.7152 * (g ?? 0) + 0.0722 * (b ?? 0);
    });
    expect(light).toEqual([...light].sort((a, b) => a - b));
    expect(new Set(light).size).toBe(count);
  }
});

test("a lane without vehicles, and one on which all stood, have words instead of a number", () => {
  expect(valueText("delay", NaN)).toBe("no vehicle");
  expect(valueText("delay", Infinity)).toBe("vehicles were stopped all the time");
  expect(valueText("flow", 123.4)).toBe("123 veh/h");
});

const loaded = { graph, picker: new Picker(graph) };
const at = (x: number) => ({ x, y: 0, reach: 1, shift: false });

test("lanes have the colour of their value, and one that is pointed at says it", async () => {
  const asked = server({ "/api/runs/r/lanes": LANES });
  const { result } = renderHook(() => {
    const [sight, show] = useState<LaneSight | null>(null);
    return useLaneUse(useLaneData("r", loaded), loaded, sight, show);
  });
  expect(asked).toEqual([]);
  expect(result.current.colors).toBeNull();
  act(() => result.current.choose("flow"));
  await waitFor(() => expect(result.current.colors).not.toBeNull());
  const { colors, legend } = result.current;
  expect(colors?.colors).toEqual(legend?.colors);
  // The first lane has the highest flow, the second none at all.
  const filled = colors?.rings.map((rings) => rings.length) ?? [];
  expect([filled[0], filled.at(-1)]).toEqual([1, 1]);
  expect(filled.slice(1, -1).every((count) => count === 0)).toBe(true);
  act(() => result.current.point(at(4)));
  expect(result.current.pointed).toEqual({ lane: "1.0.-1", value: "0 veh/h" });
  act(() => result.current.setSpan([0, 1]));
  expect(result.current.pointed?.value).toBe("no vehicle");
  expect(result.current.colors?.rings.flat()).toHaveLength(1);
  act(() => result.current.choose("speed"));
  expect(asked).toHaveLength(1);
});

test("a link may name a part of the run; one that is too long for it is the whole run", async () => {
  server({ "/api/runs/r/lanes": LANES });
  const of = (span: readonly [number, number]) =>
    renderHook(() => useLaneUse(useLaneData("r", loaded), loaded, { by: "flow", span }, vi.fn()));
  const [one, long] = [of([1, 2]), of([1, 9])];
  await waitFor(() => expect(long.result.current.colors).not.toBeNull());
  await waitFor(() => expect(one.result.current.colors).not.toBeNull());
  expect(one.result.current.span).toEqual([1, 2]);
  expect(long.result.current.span).toEqual([0, 2]);
  for (const text of ["delay", "flow,2,5"]) {
    const sight = laneSight(text);
    expect(sight && laneSightText(sight)).toBe(text);
  }
  for (const odd of ["flow,5,2", "flow,-1,2", "flow,0.5,2", "flow,1", "flow,x,y"])
    expect(laneSight(odd)).toEqual({ by: "flow", span: null });
  expect(laneSight("smell,1,2")).toBeNull();
  expect(laneSight()).toBeNull();
});

test("a drawing has the lanes in their colours below everything else", () => {
  const ring = Float64Array.from([0, 0, 4, 0, 4, 3, 0, 3]);
  const scene = { ...EMPTY_SCENE, laneColors: { colors: ["#440154", "#fde725"], rings: [[], [ring]] } };
  const size = { width: 100, height: 100 };
  const drawn = writtenPicture(size, (context) =>
    new SceneLayer(null, null, writtenPath).draw(
      context,
      { x: 0, y: 0, scale: 8 },
      size,
      1,
      LIGHT,
      scene,
      FIRST_LAYERS,
    ),
  );
  expect(drawn).toContain('<path d="M0 0L4 0L4 3L0 3Z" fill="#fde725"');
  expect(drawn).not.toContain("#440154");
});

const shown = (changed: Partial<ShownUse> = {}): ShownUse => ({
  by: "delay",
  choose: vi.fn(),
  times: [0, 60, 120, 180],
  span: [0, 3],
  setSpan: vi.fn(),
  legend: null,
  colors: null,
  pointed: null,
  point: vi.fn(),
  failure: null,
  ...changed,
});

test("what lanes show is chosen on the map, and the part of the run by keys", async () => {
  const [chosen, setSpan] = [vi.fn(), vi.fn()];
  const { user, again } = show(<LaneTools shown={shown({ by: null, choose: chosen })} />);
  expect(screen.queryByRole("slider")).toBeNull();
  await choose(user, "Colour the lanes by", "Delay per km");
  expect(chosen).toHaveBeenCalledWith("delay");
  again(<LaneTools shown={shown({ setSpan })} />);
  expect(screen.getByText("Whole run")).toBeTruthy();
  screen.getByRole("slider", { name: "End of what colours of lanes show" }).focus();
  await user.keyboard("{ArrowLeft}");
  expect(setSpan).toHaveBeenCalledWith([0, 2]);
  again(<LaneTools shown={shown({ span: [1, 2], pointed: { lane: "1.0.-1", value: "3 s/km" } })} />);
  expect(screen.getByText("1–2 min")).toBeTruthy();
  expect(screen.getByText("Lane 1.0.-1: 3 s/km")).toBeTruthy();
  again(<LaneTools shown={shown({ times: [], failure: "the run has no lane data" })} />);
  expect(screen.getByRole("alert").textContent).toBe("the run has no lane data");
});

test("the legend says what the colours of lanes mean, also where no road user is shown", () => {
  const lanes = { word: "Flow", colors: sequential(2), words: ["Below 5 veh/h", "5 veh/h and more"] };
  const none = { ego: false, lights: false, lamps: false, marks: new Set<never>() };
  show(<Legend categories={new Set()} {...none} lanes={lanes} />);
  expect(screen.getAllByRole("listitem").map((one) => one.textContent)).toEqual([
    "Lanes: Flow",
    "Below 5 veh/h",
    "5 veh/h and more",
    "No vehicle",
  ]);
});
