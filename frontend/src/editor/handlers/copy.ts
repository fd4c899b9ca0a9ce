import { onFoot, type Tool } from "./handler";
import { startingHandler } from "./starting";

/** Copies road users once, so that the first of them starts where the click is. */
export const copyTool = (ids: readonly string[]): Tool => ({
  key: `copy ${ids.join(" ")}`,
  help: "Click where the copy starts. Escape stops.",
  makes: false,
  handler: (editing) =>
    startingHandler(editing, {
      walks: onFoot(editing, ids[0]),
      badge: null,
      who: "copy",
      prompt: "Point at the place to copy to",
      setsGoals: false,
      apply: (to) => {
        editing.changes.copy(ids, to);
        editing.done();
      },
    }),
});
