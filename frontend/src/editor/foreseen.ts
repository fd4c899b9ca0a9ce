import type { Actor, Edit, EditOf, Flow, ScenarioDocument } from "../api/types";
import { withoutTiming, withStage, withTiming } from "./foreseenSignals";
import newParts from "./newParts.json";
import { everyone } from "./placing";
import { shownRule, waitingFor } from "./rules/shownRule";

/** What is not said of a new road user or flow; a test holds it against the server's own defaults. */
const NEW_ACTOR = newParts.actor as Omit<Actor, "id" | "category" | "spawn">; // JSON has texts
type Measure = ScenarioDocument["measures"][number];
const NEW_FLOW: Omit<Flow, "id" | "spawn" | "per_hour"> = newParts.flow;

/**
 * What edits will make of a document as far as the page can tell, to be shown until the server has
 * answered; null where only the server knows, as with whatever hangs together.
 */
export function foreseen(document: ScenarioDocument, edits: readonly Edit[]): ScenarioDocument | null {
  let made: ScenarioDocument | null = document;
  for (const edit of edits) {
    made = afterOne(made, edit);
    if (!made) return null;
  }
  return made;
}

function afterOne(document: ScenarioDocument, edit: Edit): ScenarioDocument | null {
  switch (edit.kind) {
    case "add_actor":
      return withNewActor(document, edit);
    case "copy_actors":
      return withCopies(document, edit);
    case "add_flow": {
      const id = edit.id ?? freeId(document, "flow");
      const flow: Flow = { ...NEW_FLOW, ...without(edit, "kind"), id };
      return { ...document, flows: [...document.flows, flow] };
    }
    case "change_flow": {
      // A new id is in other places, too.
      if ("id" in edit) return null;
      return changed(document, "flows", edit.flow, without(edit, "kind", "flow") as Partial<Flow>);
    }
    case "move_actor":
      return changed(document, "actors", edit.actor, { spawn: edit.spawn });
    case "set_goal":
      return changed(document, "actors", edit.actor, { goal: edit.goal });
    case "change_actor": {
      // Another category may need another model.
      if ("id" in edit || "category" in edit) return null;
      return changed(document, "actors", edit.actor, without(edit, "kind", "actor") as Partial<Actor>);
    }
    case "set_ego":
      return withEgo(document, edit.actor);
    case "remove_actors": {
      const gone = new Set(edit.actors);
      return { ...document, actors: document.actors.filter(({ id }) => !gone.has(id)) };
    }
    case "remove_flow":
      return { ...document, flows: document.flows.filter(({ id }) => id !== edit.flow) };
    case "set_seed":
      return { ...document, seed: edit.seed };
    case "set_simulation": {
      const simulation = { ...document.simulation, ...without(edit, "kind") };
      return { ...document, simulation: simulation as ScenarioDocument["simulation"] };
    }
    case "grow_roi":
      return { ...document, roi: [...document.roi, edit.segment] };
    case "extend_roi":
      return { ...document, roi: [...new Set([...document.roi, ...edit.segments])] };
    case "shrink_roi":
      // Who starts there goes, too, or the server refuses.
      if (edit.with_actors) return null;
      return { ...document, roi: document.roi.filter((segment) => segment !== edit.segment) };
    case "set_environment":
      return { ...document, environment: environmentAfter(document.environment, edit) };
    case "set_criteria":
      return { ...document, criteria: edit.criteria };
    case "set_measure": {
      const measures = withPart(document.measures, edit.measure as Measure, edit.instead_of);
      return measures && { ...document, measures };
    }
    case "remove_measure":
      return { ...document, measures: document.measures.filter(({ id }) => id !== edit.measure) };
    case "set_rule": {
      const { rule, instead_of } = edit;
      const rules = withPart(document.rules, shownRule(rule), instead_of);
      if (!rules || instead_of == null) return rules && { ...document, rules };
      return { ...document, rules: rules.map((one) => waitingFor(one, instead_of, rule.id)) };
    }
    case "set_signal_control":
      return { ...document, signals: { ...document.signals, control: edit.control } };
    case "set_timing":
      return withTiming(document, edit.junction, without(edit, "kind", "junction"));
    case "set_offset":
      // Of a plan of the day or of the whole light: only the server knows that.
      return edit.plan ? null : withTiming(document, edit.junction, { offset: edit.offset });
    case "set_stage":
      return withStage(document, edit.junction, edit.stage, without(edit, "kind", "junction", "stage"));
    case "clear_timing":
      return withoutTiming(document, edit.junction);
    case "remove_rule":
      return { ...document, rules: document.rules.filter(({ id }) => id !== edit.rule) };
    default:
      return null;
  }
}

/** A part in the place of that with its id, or of another one, or at the end; null if that is not there. */
function withPart<T extends { id: string }>(
  parts: readonly T[],
  part: T,
  insteadOf: string | null | undefined,
): T[] | null {
  const row = parts.findIndex(({ id }) => id === (insteadOf ?? part.id));
  if (row >= 0) return parts.with(row, part);
  return insteadOf == null ? [...parts, part] : null;
}

/** Another preset drops the values that differed from the one before. */
function environmentAfter(
  old: ScenarioDocument["environment"],
  { preset, parameters, affects_driving }: EditOf<"set_environment">,
): ScenarioDocument["environment"] {
  const begun = preset == null ? old : { ...old, preset, parameters: {} };
  return {
    ...begun,
    parameters: parameters ?? begun.parameters,
    affects_driving: affects_driving ?? begun.affects_driving,
  };
}

function withNewActor(document: ScenarioDocument, edit: EditOf<"add_actor">): ScenarioDocument {
  const id = edit.id ?? freeId(document, edit.category);
  const size = edit.size ? { height: null, ...edit.size } : null;
  const actor: Actor = { ...NEW_ACTOR, ...without(edit, "kind"), id, size };
  const grown = { ...document, actors: [...document.actors, actor] };
  return actor.ego ? (withEgo(grown, actor.id) ?? grown) : grown;
}

/** Copies at their new starts; those that cannot reach the goal from there lose it by the answer. */
function withCopies(document: ScenarioDocument, edit: EditOf<"copy_actors">): ScenarioDocument | null {
  let made = document;
  for (const [spawn, actor] of Object.entries(edit.copies)) {
    const original = made.actors.find(({ id }) => id === actor);
    if (!original) return null;
    const copy: Actor = { ...original, id: freeId(made, original.category), ego: false, spawn };
    made = { ...made, actors: [...made.actors, copy] };
  }
  return made;
}

function withEgo(document: ScenarioDocument, actor: string | null): ScenarioDocument | null {
  if (actor !== null && !document.actors.some(({ id }) => id === actor)) return null;
  const actors = document.actors.map((one) =>
    one.ego === (one.id === actor) ? one : { ...one, ego: one.id === actor },
  );
  return { ...document, actors };
}

function changed<K extends "actors" | "flows">(
  document: ScenarioDocument,
  list: K,
  id: string,
  fields: Partial<ScenarioDocument[K][number]>,
): ScenarioDocument | null {
  const row = document[list].findIndex((one) => one.id === id);
  const old = document[list][row];
  return old ? { ...document, [list]: document[list].with(row, { ...old, ...fields } as never) } : null;
}

/** As the server names what has no name: `car-1`, or the first number after it that is free. */
function freeId(document: ScenarioDocument, stem: string): string {
  const taken = new Set(everyone(document).map(({ id }) => id));
  let number = 1;
  while (taken.has(`${stem}-${number}`)) number += 1;
  return `${stem}-${number}`;
}

const without = <T extends object, K extends keyof T>(table: T, ...names: readonly K[]): Omit<T, K> =>
  Object.fromEntries(Object.entries(table).filter(([name]) => !names.includes(name as K))) as Omit<T, K>;
