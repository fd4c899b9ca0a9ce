import { onFoot, type Tool } from "./handler";
import { startingHandler } from "./starting";

/** Moves road users and flows once, so that the first of them starts where the click is. */
export const moveTool = (ids: readonly string[]): Tool => ({
  key: `move ${ids.join(" ")}`,
  help: "Click where the first of them starts. Escape stops.",
  makes: false,
  handler: (editing) =>
    startingHandler(editing, {
      walks: onFoot(editing, ids[0]),
      badge: null,
      who: "road user",
      prompt: "Point at the place to move to",
      setsGoals: false,
      apply: (to) => {
        editing.changes.move(ids, to);
        editing.done();
      },
    }),
});
