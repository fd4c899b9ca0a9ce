import { t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import type { Actor } from "../../api/types";
import type { Place } from "../../map/graph";
import type { Pointed } from "../../map/MapCanvas";
import { isFlow, stationsOf } from "../placing";
import { placeWord } from "../placeWords";
import { nearestOne } from "../scene";
import { nearestLeg, withWaypoint } from "../waypoints";
import { type Carrier, type Editing, type Hover, LOOKING, onFoot, placeHover, type Tool } from "./handler";
import { selectFrame } from "./select";

const NOWHERE = localized(
  () => t`No route leads here: a waypoint lies on a lane or walkway inside the region.`,
);
/** Share of the reach of the pointer within which it is on the line of a route. */
const ON_LINE = 0.5;

/** A place of the list of waypoints, which is there already or is made by the drag. */
interface Slot {
  index: number;
  replaces: boolean;
}

/** The waypoint, or the part of the route, that is pointed at. */
function slotAt(editing: Editing, one: Actor, at: Pointed): Slot | null {
  const places = one.via.flatMap((id, index) => {
    const place = editing.graph.place(id);
    return place ? [{ ...place, index }] : [];
  });
  const there = nearestOne(places, at.x, at.y, at.reach);
  if (there) return { index: there.index, replaces: true };
  const near = nearestLeg(editing.legs, at.x, at.y);
  return near && near.away <= ON_LINE * at.reach ? { index: near.leg, replaces: false } : null;
}

/** Whose route is shown, if it has waypoints at all: those of flows have none. */
const routed = ({ one }: Editing): Actor | null => (one && !isFlow(one) ? one : null);

/** Takes the route of the selected one along where it is held; it then leads through where it is dropped. */
export function waypointGrab(editing: Editing, at: Pointed): Carrier | null {
  const one = routed(editing);
  const slot = one && slotAt(editing, one, at);
  if (!one || !slot) return null;
  return {
    hint: t`Drop it where the route of ${one.id} is to pass`,
    needsRoute: true,
    under: (to) => tried(one, placeNear(editing, one, to), slot),
    drop: (to) => void take(editing, one, to, slot),
  };
}

/** What is said of the route where it can be held. */
export function routeHover(editing: Editing, at: Pointed): Hover | null {
  const one = routed(editing);
  return one && slotAt(editing, one, at) ? { is: "route", id: one.id } : null;
}

/** Chooses one more place that a route leads through, by a click or without the pointer. */
export const waypointTool = (id: string): Tool => ({
  key: `waypoint ${id}`,
  help: t`Now click where the route of ${id} is to pass. Escape stops.`,
  elsewhere: t`Use the middle of the route`,
  goals: false,
  makes: false,
  handler: (editing) => {
    const found = editing.ones.find((each) => each.id === id);
    const one = found && !isFlow(found) ? found : null;
    const slot = (at: Pick<Pointed, "x" | "y">): Slot => ({
      index: nearestLeg(editing.legs, at.x, at.y)?.leg ?? one?.via.length ?? 0,
      replaces: false,
    });
    return {
      ...LOOKING,
      aim: true,
      walks: onFoot(editing, id),
      under: (at) => (one ? tried(one, placeNear(editing, one, at), slot(at)) : null),
      hint: (hover) =>
        hover?.is === "place"
          ? t`${id} passes ${placeWord(editing.graph, hover.place.id)}`
          : t`Choose a via point for ${id}`,
      pick: (at) => {
        if (one && take(editing, one, at, slot(at))) editing.done();
      },
      frame: (area) => selectFrame(editing, area),
      somewhere: () => {
        const longest = [...editing.legs].sort((a, b) => b.length - a.length)[0] ?? [];
        const [x, y] = longest[Math.floor(longest.length / 2)] ?? [NaN, NaN];
        if (!one || Number.isNaN(x)) return editing.say(t`There is no route yet: choose a goal first.`);
        if (take(editing, one, { x, y, reach: 0, shift: false }, slot({ x, y }))) editing.done();
      },
    };
  },
});

const placeNear = ({ starts, ...editing }: Editing, one: Actor, { x, y, reach }: Pointed): Place | null =>
  starts.anyNear(x, y, reach, onFoot(editing, one.id), one.spawn);

function tried(one: Actor, place: Place | null, { index, replaces }: Slot): Hover | null {
  if (!place) return null;
  const stations = stationsOf({ ...one, via: withWaypoint(one.via, index, place.id, replaces) });
  return placeHover(place, stations.length > 1 ? stations : undefined);
}

function take(editing: Editing, one: Actor, at: Pointed, { index, replaces }: Slot): boolean {
  const place = placeNear(editing, one, at);
  if (!place) {
    editing.say(NOWHERE());
    return false;
  }
  const via = withWaypoint(one.via, index, place.id, replaces);
  if (via.join("\n") !== one.via.join("\n"))
    editing.changes.change({ kind: "change_actor", actor: one.id, via }, t`Waypoint of ${one.id}`);
  return true;
}
