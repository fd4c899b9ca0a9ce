import { t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import type { Actor, Flow } from "../../api/types";
import type { Place } from "../../map/graph";
import type { Pointed } from "../../map/MapCanvas";
import { placeWord } from "../placeWords";
import { stationsOf } from "../placing";
import { nearestOne } from "../scene";
import { type Carrier, type Editing, LOOKING, onFoot, placeHover, type Tool } from "./handler";
import { selectFrame } from "./select";

const NOWHERE = localized(() => t`No goal can be here: it lies on a lane or walkway inside the region.`);

/** Chooses where one goes: a goal that is suggested, or any point of the region. */
export const goalTool = (id: string): Tool => ({
  key: `goal ${id}`,
  help: t`Now click where ${id} goes: a diamond, or any other point of the region. Escape stops.`,
  elsewhere: t`Use the first suggestion`,
  goals: true,
  makes: false,
  handler: (editing) => {
    const one = editing.ones.find((each) => each.id === id);
    return {
      ...LOOKING,
      aim: true,
      walks: onFoot(editing, id),
      under: (at) => (one ? goalHover(editing, one, at) : null),
      hint: (hover) =>
        hover?.is === "place"
          ? t`${id} goes to ${placeWord(editing.graph, hover.place.id)}`
          : t`Choose the destination of ${id}`,
      pick: (at) => {
        if (one && take(editing, one, at)) editing.done();
      },
      frame: (area) => selectFrame(editing, area),
      somewhere: () => {
        const [first] = editing.goals ?? [];
        if (!one || !first) return editing.say(t`No goal can be reached from the start.`);
        editing.changes.setGoal(one, first.id);
        editing.done();
      },
    };
  },
});

/** The goal that is set, if it is pointed at. */
export function chosenGoalAt({ graph, one }: Editing, at: Pointed): Place | null {
  const place = one?.goal ? graph.place(one.goal) : undefined;
  return place ? nearestOne([place], at.x, at.y, at.reach) : null;
}

/** Takes the goal of the selected one along. */
export const goalCarrier = (editing: Editing, one: Actor | Flow): Carrier => ({
  hint: t`Moving the goal of ${one.id}: drop it on any point that it can reach`,
  under: (at) => goalHover(editing, one, at),
  drop: (at) => void take(editing, one, at),
});

function goalHover(editing: Editing, one: Actor | Flow, at: Pointed) {
  const place = goalNear(editing, one, at);
  return placeHover(place, place ? stationsOf({ ...one, goal: place.id }) : undefined);
}

function take(editing: Editing, one: Actor | Flow, at: Pointed): boolean {
  const place = goalNear(editing, one, at);
  if (!place) editing.say(NOWHERE());
  else if (place.id !== one.goal) editing.changes.setGoal(one, place.id);
  return place !== null;
}

/** A suggestion that is pointed at, or else the nearest point of the region; not the start itself. */
function goalNear(editing: Editing, one: Actor | Flow, { x, y, reach }: Pointed): Place | null {
  const suggested = nearestOne(editing.goals ?? [], x, y, reach);
  return suggested ?? editing.starts.anyNear(x, y, reach, onFoot(editing, one.id), one.spawn);
}
