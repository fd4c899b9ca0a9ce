import { call } from "./client";
import type { components } from "./schema";

export type Template = components["schemas"]["TemplateInfo"];

/** Scenes that can be placed on maps. */
export const templates = {
  all: () => call("get", "/api/templates"),
  place: (template: string, map: string, values: Record<string, number>) =>
    call("post", "/api/scenarios", { body: { map, template, values } }),
};
