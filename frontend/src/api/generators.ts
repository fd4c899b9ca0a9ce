import { call } from "./client";
import type { components } from "./schema";

export type Generator = components["schemas"]["GeneratorInfo"];
export type GeneratorOption = components["schemas"]["GeneratorOptionInfo"];
export type OptionValue = boolean | number | string;

/** An installed generator, and the options that differ from its usual ones. */
export interface Filler {
  generator: string;
  options: Record<string, OptionValue>;
}

export const generators = {
  all: () => call("get", "/api/generators"),
};
