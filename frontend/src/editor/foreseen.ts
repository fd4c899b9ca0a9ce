import type { Actor, Edit, ScenarioDocument } from "../api/types";

/**
 * What edits will make of a document as far as the page can tell, to be shown until the server has
 * answered; null where only the server knows, as with new ids and regions.
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
    case "move_actor":
      return withActor(document, edit.actor, { spawn: edit.spawn });
    case "set_goal":
      return withActor(document, edit.actor, { goal: edit.goal });
    case "change_actor": {
      const { actor } = edit;
      const fields = Object.entries(edit).filter(([name]) => name !== "kind" && name !== "actor");
      // A new id is in other places, too, and another category may need another model.
      if ("id" in edit || "category" in edit) return null;
      return withActor(document, actor, Object.fromEntries(fields) as Partial<Actor>);
    }
    case "set_ego": {
      const { actor } = edit;
      if (actor !== null && !document.actors.some(({ id }) => id === actor)) return null;
      return {
        ...document,
        actors: document.actors.map((one) =>
          one.ego === (one.id === actor) ? one : { ...one, ego: one.id === actor },
        ),
      };
    }
    case "remove_actors": {
      const gone = new Set(edit.actors);
      return { ...document, actors: document.actors.filter(({ id }) => !gone.has(id)) };
    }
    case "remove_flow":
      return { ...document, flows: document.flows.filter(({ id }) => id !== edit.flow) };
    default:
      return null;
  }
}

function withActor(document: ScenarioDocument, id: string, fields: Partial<Actor>): ScenarioDocument | null {
  const row = document.actors.findIndex((one) => one.id === id);
  const old = document.actors[row];
  return old ? { ...document, actors: document.actors.with(row, { ...old, ...fields }) } : null;
}
