import { expect, test } from "vitest";

import { LIGHT } from "../../src/map/colors";
import { Graph } from "../../src/map/graph";
import { FIRST_LAYERS } from "../../src/map/mapLayers";
import { BADGE_ROOM, markers } from "../../src/map/markers";
import { Picker } from "../../src/map/picking";
import { EMPTY_SCENE, type SceneActor } from "../../src/map/scene";
import { SceneLayer } from "../../src/map/sceneLayer";
import { writtenPath, writtenPicture } from "../../src/map/svg";
import { graph } from "../example";

const actor = (id: string, x: number, more: Partial<SceneActor> = {}): SceneActor => ({
  ...{ id, category: "car", x, y: 0, hdg: 0, length: 4.5, width: 1.8 },
  ...{ ego: false, offset: 0, selected: false, problem: false, ...more },
});
const at =
  (scale: number) =>
  (x: number, y: number): [number, number] => [x * scale, -y * scale];
const looks = (actors: readonly SceneActor[], scale: number): Record<string, string> =>
  Object.fromEntries(markers(actors, at(scale), scale).map(({ actor: { id }, look }) => [id, look]));

test("no badge hides another one, and who is looked at keeps its own", () => {
  const queue = Array.from({ length: 40 }, (_, n) => actor(`car-${n}`, 7 * n, { selected: n === 13 }));
  const found = markers(queue, at(1), 1);
  const badges = found.filter(({ look }) => look === "badge");
  expect(badges.length).toBeGreaterThan(8);
  for (const one of badges)
    for (const other of badges)
      if (one !== other)
        expect(Math.hypot(one.x - other.x, one.y - other.y)).toBeGreaterThanOrEqual(BADGE_ROOM);
  expect(found).toHaveLength(queue.length);
  expect(found.filter(({ look }) => look === "dot")).toHaveLength(queue.length - badges.length);
  expect(looks(queue, 1)["car-13"]).toBe("badge");
  expect(found.at(-1)?.actor.id).toBe("car-13");
});

test("near, each vehicle is a body without a badge above it, and pedestrians have small badges", () => {
  const walker = actor("ped-1", 5, { category: "pedestrian", length: 0.5, width: 0.5 });
  expect(looks([actor("car-1", 0), actor("car-2", 7), walker], 4)).toEqual({
    "car-1": "body",
    "car-2": "body",
    "ped-1": "badge",
  });
});

test("on a whole town with hundreds of road users all are dots but those one looks at", () => {
  const many = Array.from({ length: 400 }, (_, n) => actor(`car-${n}`, 100 * n, { ego: n === 5 }));
  const found = markers(many, at(0.5), 0.5);
  expect(found.filter(({ look }) => look !== "dot").map(({ actor: { id } }) => id)).toEqual(["car-5"]);
});

const SIZE = { width: 400, height: 300 };

test("the kind of a vehicle is drawn in its body and not above it", () => {
  const [x, y] = [graph.columns.x[0] ?? 0, graph.columns.y[0] ?? 0];
  const actors = [actor("car-1", x, { y })];
  const picture = writtenPicture(SIZE, (context) =>
    new SceneLayer(null, null, writtenPath).draw(
      context,
      { x, y, scale: 12 },
      SIZE,
      1,
      LIGHT,
      { ...EMPTY_SCENE, actors },
      FIRST_LAYERS,
    ),
  );
  // A badge is a circle; the sign in the body is 0.85 of its width of 1.8 m and in its middle.
  expect(picture).not.toMatch(/ A ?12/);
  const size = 12 * 1.8 * 0.85;
  const corner = 150 - size / 2;
  const matrix = new RegExp(
    `matrix\\(${(size / 24).toFixed(3).slice(0, 4)}[\\d.]* 0 0 [\\d.]+ ([\\d.]+) ([\\d.]+)\\)`,
  );
  const found = matrix.exec(picture.replaceAll(",", " "));
  expect(Number(found?.[2])).toBeCloseTo(corner, 0);
});

test("edges to the lanes beside, which cross each other, are drawn only where they are asked for", () => {
  const edges = { source: [0, 0], target: [1, 2], relation: [0, 1] };
  const pair = new Graph({ ...graph.columns, edges });
  const picker = new Picker(pair);
  const view = { x: graph.columns.x[0] ?? 0, y: graph.columns.y[0] ?? 0, scale: 20 };
  const drawn = (changes: boolean): string =>
    writtenPicture(SIZE, (context) =>
      new SceneLayer(pair, picker, writtenPath).draw(
        context,
        view,
        SIZE,
        1,
        LIGHT,
        { ...EMPTY_SCENE, nodes: { vehicles: true, walks: false, inside: null } },
        { ...FIRST_LAYERS, changes },
      ),
    );
  const colored = (picture: string): boolean => /#FF4261|#00E279/i.test(picture);
  expect(FIRST_LAYERS.changes).toBe(false);
  expect(colored(drawn(false))).toBe(false);
  expect(colored(drawn(true))).toBe(true);
});
