import type { Step } from "../scene";
import { withDetectors } from "./detectors";
import { type Editing, type Handler, LOOKING, type Tool } from "./handler";
import { lightsHandler, withLights } from "./lights";
import { pickingHandler } from "./picking";
import { regionHandler } from "./region";
import { selectHandler } from "./select";
import { trafficHandler } from "./traffic";

const lookingHandler = (): Handler => LOOKING;

/** Steps in which the map is pointed at in a way of their own. */
const OF_STEP: Partial<Record<Step, (editing: Editing) => Handler>> = {
  region: regionHandler,
  traffic: trafficHandler,
  transit: lookingHandler,
  // Their detectors are dragged there, too.
  lights: (editing) => withDetectors(lightsHandler(editing), editing),
  measures: lookingHandler,
  rules: lookingHandler,
  study: lookingHandler,
};

/** Who is in charge of the map; lights can be asked for their programs unless places are chosen. */
export function handlerFor(step: Step, tool: Tool | null, editing: Editing): Handler {
  if (editing.pick.now) return pickingHandler(editing);
  const handler = (OF_STEP[step] ?? tool?.handler ?? selectHandler)(editing);
  return handler.aim ? handler : withDetectors(withLights(handler, editing), editing);
}
