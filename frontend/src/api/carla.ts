import { ask } from "./client";

/** Whether runs can be shown in CARLA, and what to do about it, in the server's words. */
export interface CarlaInfo {
  state: "connected" | "absent" | "wrong_version";
  address: string;
  message: string;
}

export const carla = {
  info: () => ask<CarlaInfo>("/carla"),
  /** Pictures that replace each other as they come; for an `img`. */
  cameraUrl: (run: string) => `/api/runs/${encodeURIComponent(run)}/camera`,
  comparisonUrl: (run: string) => `/api/runs/${encodeURIComponent(run)}/parity.html`,
};
