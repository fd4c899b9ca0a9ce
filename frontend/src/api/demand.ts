import { call, form } from "./client";
import { followJob } from "./maps";
import type { components } from "./schema";
import type { Job } from "./types";

type Schemas = components["schemas"];

export type Demand = Schemas["Demand"];
export type Zone = Schemas["Zone"];
export type Matrix = Schemas["Matrix"];
export type Counts = Schemas["Counts"];
export type RouteChoice = Schemas["RouteChoice"];
export type TripParking = Schemas["TripParking"];
export type VehicleInput = Schemas["VehicleInput"];
/** Whether vehicles come at random, or as many as are said with every seed. */
export type Arrivals = VehicleInput["arrivals"];
/** Where vehicles can drive into the region. */
export type Entry = Schemas["EntryPlace"];
/** One of the three amounts is not null. */
export type Background = Schemas["Background"];
/** Relative shares; they need not sum to one. */
export type Mix = Counts["mix"];

type Table = Schemas["Body_table_api_scenarios__name__demand_table_post"];
/** What can be read from a table. */
export type TableKind = Table["kind"];

export const demand = {
  table: (name: string, version: number, kind: TableKind, file: File, part: string | null) => {
    const fields = { version: String(version), kind, file, part } satisfies Record<
      keyof Omit<Table, "day">,
      unknown
    >;
    return call("post", "/api/scenarios/{name}/demand/table", {
      params: { path: { name } },
      body: form(fields),
    });
  },
  entries: (name: string) =>
    call("get", "/api/scenarios/{name}/demand/entries", { params: { path: { name } } }),
  /** Makes a day of traffic, which takes minutes with a trial; null if it was cancelled. */
  day: async (
    name: string,
    version: number,
    wish: Omit<Schemas["WholeDay"], "version">,
    onStep: (job: Job) => void,
  ): Promise<Schemas["DayMade"] | null> => {
    const body = { version, ...wish };
    const { job } = await call("post", "/api/scenarios/{name}/demand/day", {
      params: { path: { name } },
      body,
    });
    return (await followJob(job, onStep))?.day ?? null;
  },
};
