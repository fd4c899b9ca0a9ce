import { expect, test } from "vitest";

import {
  freeStation,
  station,
  stationFields,
  stationsOf,
  type Study,
  studyNote,
  toggled,
} from "../src/editor/study";

const study: Study = {
  warm_up: 600,
  interval: 900,
  detectors: [{ id: "detector-1", nodes: ["1.0.-1.40"] }],
  sections: [{ id: "through", begin: ["1.0.-1.5"], end: ["3.0.1.5"] }],
  cordons: [{ id: "centre", entries: ["1.0.-1.5"], exits: ["1.0.1.5", "3.0.1.5"] }],
};
const NOTHING: Study = { warm_up: 0, interval: null, detectors: [], sections: [], cordons: [] };

test("stations become the fields of an edit again, each kind by itself", () => {
  const all = stationsOf(study);
  expect(all.map(({ id }) => id)).toEqual(["detector-1", "through", "centre"]);
  expect(stationFields("detectors", all)).toEqual({ detectors: study.detectors });
  expect(stationFields("sections", all)).toEqual({ sections: study.sections });
  expect(stationFields("cordons", all)).toEqual({ cordons: study.cordons });
});

test("a lane is added to a line, and taken out by naming it again", () => {
  const one = station("cordons", "centre", [["a"], ["b"]]);
  const more = toggled(one, "exits", "c");
  expect(more.lines.map(({ nodes }) => nodes)).toEqual([["a"], ["b", "c"]]);
  expect(toggled(more, "exits", "b").lines.map(({ nodes }) => nodes)).toEqual([["a"], ["c"]]);
});

test("a new station takes the first name that is free", () => {
  expect(freeStation(study, "detectors")).toBe("detector-2");
  expect(freeStation(study, "sections")).toBe("section-1");
});

test("the note says what is analysed and how many stations there are", () => {
  expect(studyNote(study)).toBe("warm-up 10 min, every 15 min, 3 stations");
  expect(studyNote({ ...study, warm_up: 0, interval: 90 })).toBe("every 90 s, 3 stations");
  expect(studyNote(NOTHING)).toBe("The whole run");
});
