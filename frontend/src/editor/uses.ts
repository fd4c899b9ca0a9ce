import type { ScenarioDocument } from "../api/types";
import { partsOf } from "./criteria";

/** Rules by their ids, and criteria by their places in the list, that are about some road users. */
export interface Uses {
  rules: readonly string[];
  criteria: readonly number[];
}

/** Road users that are to be removed, and what uses them. */
export interface AskedRemoval {
  ids: readonly string[];
  uses: Uses;
}

/** What of a scenario names one of some road users. */
export function usesOf(
  { rules, criteria }: Pick<ScenarioDocument, "rules" | "criteria">,
  ids: readonly string[],
): Uses {
  const wanted = new Set(ids);
  return {
    rules: rules.filter((rule) => names({ ...rule, id: null }, wanted)).map(({ id }) => id),
    criteria: criteria.flatMap((text, n) => (wanted.has(partsOf(text)?.actor ?? "") ? [n] : [])),
  };
}

/** Whether a text anywhere in it is one of them: conditions and actions have them in many fields. */
function names(part: unknown, wanted: ReadonlySet<string>): boolean {
  if (typeof part === "string") return wanted.has(part);
  return typeof part === "object" && part !== null && Object.values(part).some((one) => names(one, wanted));
}
