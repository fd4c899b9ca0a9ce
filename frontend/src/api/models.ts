import { call } from "./client";
import type { components } from "./schema";

/** A generator, behaviour model or simulator that is installed. */
export type Offered = components["schemas"]["OfferedInfo"];
export type OfferedOption = components["schemas"]["OptionInfo"];
export type OptionValue = boolean | number | string;

/** One of them, and the options that differ from its usual ones. */
export interface Chosen {
  name: string;
  options: Record<string, OptionValue>;
}

export const models = {
  generators: () => call("get", "/api/generators"),
  behaviours: () => call("get", "/api/behaviours"),
  simulators: () => call("get", "/api/simulators"),
  /** What a simulator does not do of a scenario. */
  unsupported: (simulator: string, scenario: string) =>
    call("get", "/api/simulators/{simulator}/unsupported", {
      params: { path: { simulator }, query: { scenario } },
    }),
};
