import { call } from "./client";
import type { components } from "./schema";

export type Template = components["schemas"]["TemplateInfo"];

/** Scenes that can be placed on maps. */
export const templates = {
  all: () => call("get", "/api/templates"),
  /** Why a map has no room for a template with these numbers; empty where it has. */
  room: (template: string, map: string, values: Record<string, number>) =>
    call("post", "/api/templates/{template}/room", {
      params: { path: { template } },
      body: { map, values },
    }).then(({ reason }) => reason),
  place: (template: string, map: string, values: Record<string, number>) =>
    call("post", "/api/scenarios", { body: { map, template, values } }),
};
