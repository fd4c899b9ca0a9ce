import type { EditOf, ScenarioDocument } from "../api/types";
import newParts from "./newParts.json";

type Timing = ScenarioDocument["signals"]["junctions"][number];

/** What is not said of a light that is timed for the first time. */
const NEW_TIMING: Omit<Timing, "junction"> = newParts.timing;

/** The timing of a junction with other fields; a new one goes to the end. */
export function withTiming(document: ScenarioDocument, junction: string, fields: object): ScenarioDocument {
  const { signals } = document;
  const row = signals.junctions.findIndex((one) => one.junction === junction);
  const made: Timing = { ...(signals.junctions[row] ?? { ...NEW_TIMING, junction }), ...fields };
  const junctions = row < 0 ? [...signals.junctions, made] : signals.junctions.with(row, made);
  return { ...document, signals: { ...signals, junctions } };
}

/** Fields of one stage of a program of the scenario's own; null if it has no such stage. */
export function withStage(
  document: ScenarioDocument,
  junction: string,
  stage: string,
  fields: Omit<EditOf<"set_stage">, "kind" | "junction" | "stage">,
): ScenarioDocument | null {
  const stages = document.signals.junctions.find((one) => one.junction === junction)?.stages ?? [];
  const row = stages.findIndex(({ id }) => id === stage);
  const old = stages[row];
  return old
    ? withTiming(document, junction, { stages: stages.with(row, { ...old, ...fields } as never) })
    : null;
}

export function withoutTiming(document: ScenarioDocument, junction: string): ScenarioDocument {
  const { signals } = document;
  const junctions = signals.junctions.filter((one) => one.junction !== junction);
  return { ...document, signals: { ...signals, junctions } };
}
