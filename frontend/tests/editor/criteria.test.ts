import { expect, test } from "vitest";

import { criteriaNote, criterionWords, partsOf, suggestedCriteria, textOf } from "../../src/editor/criteria";

const MEASURES = {
  run: [{ name: "mean_delay", label: "mean delay", unit: "s" }],
  actors: [
    { name: "arrived", label: "goal reached", unit: "" },
    { name: "max_speed", label: "highest speed", unit: "m/s" },
    { name: "stopped_before", label: "gap when stopped", unit: "m" },
    { name: "fired", label: "firing", unit: "" },
  ],
};

test.each([
  "collided == 0",
  "arrived >= 95 %",
  "min_ttc(ego) >= 1.5 s",
  "max_speed(flow.3) <= 50 km/h",
  "stopped_before(ego,child) >= 0.5 m",
])("%s has parts that make the same text", (text) => {
  const parts = partsOf(text);
  expect(parts && textOf(parts)).toBe(text);
});

test("what is no criterion has no parts and is shown as it is", () => {
  expect(partsOf("usable")).toBeNull();
  expect(criterionWords("usable", MEASURES)).toBe("usable");
  expect(criterionWords("own_figure == 1", MEASURES)).toBe("own_figure == 1");
});

test("criteria are sentences with the unit they were written in, or that of the measure", () => {
  const said = (text: string) => criterionWords(text, MEASURES);
  expect(said("arrived(ego) == 1")).toBe("ego reaches its goal");
  expect(said("max_speed(van) <= 50 km/h")).toBe("Highest speed of van: at most 50 km/h");
  expect(said("stopped_before(ego,child) >= 0.5 m")).toBe("Gap when stopped of ego to child: at least 0.5 m");
  expect(said("fired(cut-in) == 1")).toBe("cut-in fires");
  expect(said("mean_delay < 40")).toBe("Mean delay: less than 40 s");
});

test("the step says how many there are", () => {
  expect(["", "a", "a b"].map((one) => criteriaNote(one.split(" ").filter(Boolean)))).toEqual([
    "When has a run passed?",
    "1 criterion",
    "2 criteria",
  ]);
});

test("no collision and a gap before each pedestrian are suggested, until they are asked", () => {
  const actors = [
    { id: "car-1", ego: true, category: "car" },
    { id: "van-1", ego: false, category: "van" },
    { id: "child", ego: false, category: "pedestrian" },
  ] as const;
  const [hit, gap] = ["collided(ego) == 0", "stopped_before(ego,child) >= 0.5 m"];
  expect(suggestedCriteria(actors, [])).toEqual([hit, gap]);
  expect(suggestedCriteria(actors, ["collided(ego) == 0"])).toEqual([gap]);
  expect(suggestedCriteria(actors.slice(1), [])).toEqual([]);
  const many = Array.from({ length: 9 }, (_, n) => ({ ...actors[2], id: `child-${n}` }));
  expect(suggestedCriteria([actors[0], ...many], [])).toHaveLength(5);
});
