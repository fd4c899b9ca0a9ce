import type { Step } from "../scene";
import type { Editing, Handler, Tool } from "./handler";
import { regionHandler } from "./region";
import { selectHandler } from "./select";
import { trafficHandler } from "./traffic";

/** Steps in which the map is pointed at in a way of their own. */
const OF_STEP: Partial<Record<Step, (editing: Editing) => Handler>> = {
  region: regionHandler,
  traffic: trafficHandler,
};

/** Who is in charge of the map. */
export const handlerFor = (step: Step, tool: Tool | null, editing: Editing): Handler =>
  (OF_STEP[step] ?? tool?.handler ?? selectHandler)(editing);
