import type { Facts } from "../api/removal";
import { count } from "./words";

const KEPT = "It stays in the wastebasket for 30 days and can be restored.";

/** What depends on something that is to be removed, in sentences. */
export function factsWords({ kind, scenarios, runs, live }: Facts): string[] {
  if (kind === "run") {
    if (live) return ["This run is live. Stop it first."];
    return ["Its figures, its recording and its report go with it. The scenario stays.", KEPT];
  }
  const going = live === 0 ? "" : live === 1 ? ", 1 of them live" : `, ${live} of them live`;
  const ran = `${count(runs, "run")}${going}`;
  const finish = live === 0 ? [] : ["Live runs still end with their report."];
  if (kind === "scenario") return [runs ? `It has ${ran}. They stay.` : "It has no runs.", ...finish, KEPT];
  if (!scenarios && !runs) return ["Nothing was made on this map.", KEPT];
  return [
    `${count(scenarios, "scenario")} and ${ran} were made on this map. They stay, but the scenarios need it to run.`,
    ...finish,
    KEPT,
  ];
}
