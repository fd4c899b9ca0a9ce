import { address, call } from "./client";
import type { components } from "./schema";

/** Whether runs can be shown in CARLA, and what to do about it, in the server's words. */
export type CarlaInfo = components["schemas"]["CarlaInfo"];

export const carla = {
  info: () => call("get", "/api/carla"),
  /** Pictures that replace each other as they come; for an `img`. */
  cameraUrl: (run: string) => address("/api/runs/{run}/camera", { params: { path: { run } } }),
  comparisonUrl: (run: string) => address("/api/runs/{run}/parity.html", { params: { path: { run } } }),
};
