import { flowWord } from "../../ui/words";
import type { Tool } from "./handler";
import { startHelp, startingHandler, startPrompt } from "./starting";

/** Places a flow of vehicles or pedestrians with each click. */
export function flowTool(walks: boolean): Tool {
  const who = flowWord(walks).toLowerCase();
  return {
    key: walks ? "pedestrian flow" : "vehicle flow",
    help: startHelp(who, walks),
    makes: true,
    handler: (editing) =>
      startingHandler(editing, {
        walks,
        badge: null,
        who,
        prompt: startPrompt(who, walks),
        setsGoals: true,
        apply: (to) => editing.changes.placeFlow(walks, to),
      }),
  };
}
