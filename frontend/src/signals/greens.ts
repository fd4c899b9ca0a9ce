import { t } from "@lingui/core/macro";

import type { GroupPair } from "../api/signals";
import type { Timing } from "./editing";

/** What a signal group shows in a stage. */
export type Green = "red" | "protected" | "permissive";
export type ProgramStage = Timing["stages"][number];
export type ProgramGroup = Timing["groups"][number];

export const greenOf = ({ protected: free, permissive }: ProgramStage, group: string): Green =>
  free.includes(group) ? "protected" : permissive.includes(group) ? "permissive" : "red";

/** Stages of a group with its green in one of them changed. */
export function withGreen(
  stages: readonly ProgramStage[],
  group: string,
  stage: string,
  green: Green,
): { protected: string[]; permissive: string[] } {
  const shown = (one: ProgramStage): Green => (one.id === stage ? green : greenOf(one, group));
  const of = (wanted: Green): string[] => stages.filter((one) => shown(one) === wanted).map(({ id }) => id);
  return { protected: of("protected"), permissive: of("permissive") };
}

/** Why a group may not have this green in a stage, in plain words; null if it may. */
export function conflictWords(
  pairs: readonly GroupPair[],
  stage: ProgramStage,
  group: string,
  green: Green,
): string | null {
  if (green === "red") return null;
  const shown = (id: string): Green => (id === group ? green : greenOf(stage, id));
  const others = [...stage.protected, ...stage.permissive].filter((id) => id !== group);
  for (const { ending, beginning, together } of pairs) {
    const other = ending === group ? beginning : beginning === group ? ending : null;
    if (other === null || !others.includes(other)) continue;
    if (together === "never")
      return t`${group} and ${other} cross: they can never be green together. ${other} is green in stage ${stage.id}.`;
    if (together === "yields" && shown(ending) === "protected") {
      const first = beginning;
      return t`In stage ${stage.id} ${ending} has to give way to ${first}: choose “gives way” for ${ending}, or another stage.`;
    }
  }
  return null;
}
