import { call } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];

/** What stays behind, and needs what is to be removed. */
export type Facts = Schemas["RemovalInfo"];
export type Kind = Facts["kind"];
/** Something in the wastebasket; bytes, and seconds since 1970. */
export type Removed = Schemas["RemovedRow"];
export type BrokenMap = Schemas["BrokenMapInfo"];

export const removal = {
  facts: (kind: Kind, name: string): Promise<Facts> => {
    if (kind === "map") return call("get", "/api/maps/{name}/removal", { params: { path: { name } } });
    if (kind === "scenario")
      return call("get", "/api/scenarios/{name}/removal", { params: { path: { name } } });
    return call("get", "/api/runs/{run}/removal", { params: { path: { run: name } } });
  },
  /** Nothing for a run that has left nothing to keep. */
  remove: (kind: Kind, name: string): Promise<Schemas["RemovedInfo"] | null> => {
    if (kind === "map") return call("delete", "/api/maps/{name}", { params: { path: { name } } });
    if (kind === "scenario") return call("delete", "/api/scenarios/{name}", { params: { path: { name } } });
    return call("delete", "/api/runs/{run}", { params: { path: { run: name } } });
  },
  trash: () => call("get", "/api/trash"),
  restore: (item: string) => call("post", "/api/trash/{item}/restore", { params: { path: { item } } }),
  deleteForGood: (item: string) => call("delete", "/api/trash/{item}", { params: { path: { item } } }),
  brokenMaps: () => call("get", "/api/broken-maps"),
};
