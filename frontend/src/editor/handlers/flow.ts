import { t } from "@lingui/core/macro";

import { inSentence, flowWord } from "../../ui/words";
import type { Tool } from "./handler";
import { NEXT_POINT, startHelp, startingHandler, startPrompt } from "./starting";

/** Places a flow of vehicles or pedestrians with each click. */
export function flowTool(walks: boolean): Tool {
  const who = inSentence(flowWord(walks));
  return {
    key: walks ? t`pedestrian flow` : t`vehicle flow`,
    help: startHelp(who, walks),
    elsewhere: NEXT_POINT(),
    goals: false,
    makes: true,
    handler: (editing) =>
      startingHandler(editing, {
        walks,
        badge: null,
        who,
        prompt: startPrompt(who, walks),
        apply: (to) => editing.changes.placeFlow(walks, to),
      }),
  };
}
