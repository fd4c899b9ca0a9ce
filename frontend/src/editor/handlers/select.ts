import { t } from "@lingui/core/macro";

import type { Area } from "../../map/areas";
import type { Place } from "../../map/graph";
import type { Pointed } from "../../map/MapCanvas";
import { inFrame, nearestOne } from "../scene";
import { carrier } from "./carry";
import { chosenGoalAt, goalCarrier } from "./goal";
import { type Editing, type Handler, LOOKING, onFoot } from "./handler";
import { routeHover, waypointGrab } from "./waypoint";

/** Without a tool: a click selects or sets the goal; a drag takes along what is selected, its goal or route. */
export const selectHandler = (editing: Editing): Handler => ({
  ...LOOKING,
  walks: editing.one ? onFoot(editing, editing.one.id) : null,
  under: (at) =>
    oneAt(editing, at) || chosenGoalAt(editing, at) || goalAt(editing, at) ? null : routeHover(editing, at),
  hint: (hover) =>
    hover?.is === "route" ? t`Drag the route of ${hover.id} to lead it through another place` : null,
  pick: (at) => {
    editing.openActors();
    const goal = goalAt(editing, at);
    if (goal) goal.set();
    else choose(editing, oneAt(editing, at), at.shift);
  },
  grab: (at) => {
    const id = oneAt(editing, at);
    // A drag that begins on any other one moves the map, as everywhere else.
    if (id !== null && editing.selection.includes(id)) return carrier(editing, id);
    if (editing.one && chosenGoalAt(editing, at)) return goalCarrier(editing, editing.one);
    return id !== null || goalAt(editing, at) ? null : waypointGrab(editing, at);
  },
  frame: (area) => selectFrame(editing, area),
});

/** Selects all in an area, whatever is in the hand. */
export function selectFrame({ actors, flows, select, openActors }: Editing, area: Area): void {
  openActors();
  select(inFrame([...actors, ...flows], area));
}

/** Whose body or arrow is pointed at. */
export function oneAt({ actors, flows }: Editing, { x, y, reach }: Pointed): string | null {
  return (nearestOne(actors, x, y, reach) ?? nearestOne(flows, x, y, reach))?.id ?? null;
}

/** The goal that is pointed at, of the one that is selected. */
export function goalAt(editing: Editing, at: Pointed): { place: Place; set: () => void } | null {
  const { one, goals, changes } = editing;
  const place = one && oneAt(editing, at) === null ? nearestOne(goals ?? [], at.x, at.y, at.reach) : null;
  return one && place && { place, set: () => changes.setGoal(one, place.id) };
}

/** Selects one, or adds it to the selection, or takes it out again; null is nothing under the pointer. */
export function choose(
  { selection, select }: Pick<Editing, "selection" | "select">,
  id: string | null,
  more: boolean,
): void {
  if (id === null) {
    if (!more) select([]);
  } else if (!more) select([id]);
  else select(selection.includes(id) ? selection.filter((other) => other !== id) : [...selection, id]);
}
