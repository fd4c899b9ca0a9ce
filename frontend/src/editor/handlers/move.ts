import { t } from "@lingui/core/macro";

import { onFoot, type Tool } from "./handler";
import { NEXT_POINT, startingHandler } from "./starting";

/** Moves road users and flows once, so that the first of them starts where the click is. */
export const moveTool = (ids: readonly string[]): Tool => ({
  key: `move ${ids.join(" ")}`,
  help: t`Click where the first of them starts. Escape stops.`,
  elsewhere: NEXT_POINT(),
  goals: false,
  makes: false,
  handler: (editing) =>
    startingHandler(editing, {
      walks: onFoot(editing, ids[0]),
      badge: null,
      who: t`road user`,
      prompt: t`Point at the place to move to`,
      apply: (to) => {
        editing.changes.move(ids, to);
        editing.done();
      },
    }),
});
