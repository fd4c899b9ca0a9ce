import type { DayPlan, Detector, LightProgram } from "../../src/api/signals";

const picture = '<svg role="img"><title>picture</title></svg>';

/** Two stages with yellow and all red between them; 40 s. */
export const plan: DayPlan = {
  id: "day",
  cycle: 40,
  offset: 5,
  times: [6 * 3600],
  begins: [],
  stages: [
    {
      id: "1",
      begin: 0,
      end: 15,
      split: 20,
      least: 0,
      most: 0,
      on_call: false,
      groups: ["K1", "F1"],
      permissive: ["K1"],
      words: "stage 1: 15 s",
      picture,
    },
    {
      id: "2",
      begin: 20,
      end: 35,
      split: 20,
      least: 5,
      most: 25,
      on_call: true,
      groups: ["K2"],
      permissive: [],
      words: "stage 2: 5 to 25 s",
      picture,
    },
  ],
  phases: [
    { seconds: 10, state: "gr", name: "stage 1", stage: "1" },
    { seconds: 5, state: "gr", name: "stage 1", stage: "1" },
    { seconds: 3, state: "yr", name: "yellow", stage: "" },
    { seconds: 2, state: "rr", name: "all red", stage: "" },
    { seconds: 15, state: "rG", name: "stage 2", stage: "2" },
    { seconds: 3, state: "ry", name: "yellow", stage: "" },
    { seconds: 2, state: "rr", name: "all red", stage: "" },
  ],
  bars: picture,
  plot: [0.2, 0.95],
};

export const detector = (id: string, more: Partial<Detector> = {}): Detector => ({
  id,
  label: "D1",
  stages: ["1"],
  call: false,
  bus: false,
  ahead: 30,
  length: 2,
  gap: 3,
  calls: [],
  place: [],
  ...more,
});

export const program = (more: Partial<LightProgram> = {}): LightProgram => ({
  id: "J1",
  junctions: ["10"],
  control: "fixed",
  origin: "scenario",
  groups: [
    { id: "K1", movements: ["r1"], links: [0], walk: false },
    { id: "K2", movements: ["r2"], links: [1], walk: false },
  ],
  plans: [plan],
  detectors: [],
  turns: [],
  movements: [],
  pairs: [],
  lanes: [],
  site: picture,
  ground: "",
  legend: [{ picture, words: "green" }],
  ...more,
});
