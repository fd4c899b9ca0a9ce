import type { Category } from "../../api/types";
import { inSentence, CATEGORY_WORD } from "../../ui/words";
import type { Tool } from "./handler";
import { NEXT_POINT, startHelp, startingHandler, startPrompt } from "./starting";

/** Places one road user of a kind with each click. */
export function placeTool(category: Category): Tool {
  const walks = category === "pedestrian";
  const who = inSentence(CATEGORY_WORD()[category]);
  return {
    key: `place ${category}`,
    help: startHelp(who, walks),
    elsewhere: NEXT_POINT(),
    goals: false,
    makes: true,
    handler: (editing) =>
      startingHandler(editing, {
        walks,
        badge: category,
        who,
        prompt: startPrompt(who, walks),
        size: walks ? null : editing.sizeOf(category),
        apply: (to) => editing.changes.place(category, to),
      }),
  };
}
