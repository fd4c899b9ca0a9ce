import type { Summary } from "../src/api/runs";

const ACTORS: Summary["actors"] = {
  planned: 0,
  inserted: null,
  arrived: null,
  running: null,
  waiting: null,
  stranded: null,
  teleported: null,
  collided: null,
  emergency_stopped: null,
};

/** Summary of a run as the server sends it, of which only some is known. */
export const summary = (
  known: Partial<Omit<Summary, "actors">> = {},
  actors: Partial<Summary["actors"]> = {},
): Summary => ({
  format: "odscen-run",
  version: 1,
  usable: null,
  status: "completed",
  error: null,
  stopped: false,
  scenario: "s",
  map: "m",
  map_sha256: null,
  meso: false,
  driven_by: null,
  seed: 0,
  until: 60,
  step_length: 0.5,
  sim_seconds: null,
  steps: null,
  wall_seconds: 1,
  real_time_factor: null,
  insertion_error_max: null,
  figures: {},
  gridlock: null,
  expectations: [],
  problems: [],
  notes: [],
  files: {},
  versions: {},
  slices: null,
  ...known,
  actors: { ...ACTORS, ...actors },
});
