/** What does not compile: the compiler fails this file where a line below has no error. */
import { api, call } from "../src/api/client";
import { runs, type Summary } from "../src/api/runs";
import type { Edit, EditOf } from "../src/api/types";

const actor = "car-1";

export const right: Edit[] = [
  { kind: "add_actor", category: "car", spawn: "1.0.-1.0", style: "sporty", ego: true },
  { kind: "change_actor", actor, speed: null },
  { kind: "set_goal", actor, goal: null },
  { kind: "set_counts", counts: "survey", rows: [["r1", 0, 900, 12]], mix: { car: 1, bus: 2 } },
  { kind: "set_environment", parameters: { wetness: 20 } },
];

export const wrong: Edit[] = [
  // @ts-expect-error there is no such edit
  { kind: "add_actr", category: "car", spawn: "1.0.-1.0" },
  // @ts-expect-error a misspelt argument
  { kind: "change_actor", actor, sped: 3 },
  // @ts-expect-error a misspelt argument that must be given, too
  { kind: "move_actor", actor, spwan: "1.0.-1.0" },
  // @ts-expect-error an argument is missing
  { kind: "add_actor", category: "car" },
  // @ts-expect-error of the wrong type
  { kind: "set_seed", seed: "7" },
  // @ts-expect-error there is no such category
  { kind: "add_actor", category: "tram", spawn: "1.0.-1.0" },
  // @ts-expect-error there is no such category in a mix
  { kind: "set_counts", counts: "survey", mix: { tram: 1 } },
  // @ts-expect-error an argument of another edit
  { kind: "set_ego", actor, goal: null },
  // @ts-expect-error null where there is always a value
  { kind: "change_actor", actor, ego: null },
  // @ts-expect-error a row without its number
  { kind: "set_counts", counts: "survey", rows: [["r1", 0, 900]] },
];

export const control: EditOf<"set_signal_control">["control"] = "fixed";

/** Never called. */
export async function neverCalled(): Promise<unknown[]> {
  const summary: Summary | null = (await runs.info("r")).summary;
  return [
    // @ts-expect-error there is no such path
    call("get", "/api/map"),
    // @ts-expect-error the path has no such method
    call("delete", "/api/assets"),
    // @ts-expect-error the path has a name
    call("get", "/api/maps/{name}"),
    // @ts-expect-error a query with a misspelt argument
    call("get", "/api/scenarios/{name}/goals", { params: { path: { name: "s" }, query: { spwan: "n" } } }),
    // @ts-expect-error a body with a misspelt argument
    call("post", "/api/scenarios", { body: { mapp: "m" } }),
    // @ts-expect-error there is no such way to steer a run
    runs.control("r", "faster"),
    // @ts-expect-error there is no such count
    summary?.actors.vanished,
    // @ts-expect-error there is no such figure of a map
    (await api.map("m")).statistics.rivers,
  ];
}
