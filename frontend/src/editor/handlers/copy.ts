import { t } from "@lingui/core/macro";

import { onFoot, type Tool } from "./handler";
import { NEXT_POINT, startingHandler } from "./starting";

/** Copies road users once, so that the first of them starts where the click is. */
export const copyTool = (ids: readonly string[]): Tool => ({
  key: `copy ${ids.join(" ")}`,
  help: t`Click where the copy starts. Escape stops.`,
  elsewhere: NEXT_POINT(),
  goals: false,
  makes: false,
  handler: (editing) =>
    startingHandler(editing, {
      walks: onFoot(editing, ids[0]),
      badge: null,
      who: "copy",
      prompt: t`Point at the place to copy to`,
      apply: (to) => {
        editing.changes.copy(ids, to);
        editing.done();
      },
    }),
});
