import { t } from "@lingui/core/macro";

import { lengthText } from "../../language/units";
import type { Pointed } from "../../map/MapCanvas";
import { loopAt, loopOn, type LoopPlace, nearest } from "../../signals/laneLines";
import type { Carrier, Editing, Handler, Hover } from "./handler";

/** A click this near to a lane, and a drag this near to a detector, means it, metres. */
const LANE_REACH = 4;
const LOOP_REACH = 3;
/** Metres of a new loop. */
const LOOP = 2;

/** Where a loop would lie that is placed here. */
export const loopUnder = ({ program }: Editing, at: Pointed): LoopPlace | null =>
  loopAt(program?.lanes ?? [], [at.x, at.y], Math.max(at.reach, LANE_REACH), LOOP);

export const loopHover = (loop: LoopPlace | null): Hover | null => loop && { is: "loop", ...loop };

/** A loop in words, before it is placed. */
export const loopWords = ({ at, before }: LoopPlace): string =>
  t`Lane ${at}, ${lengthText(before, 1)} before the stop line`;

/** Besides what a handler does: detectors of the program that is shown are dragged along their lanes. */
export function withDetectors(handler: Handler, editing: Editing): Handler {
  return { ...handler, grab: (at) => detectorGrab(editing, at) ?? handler.grab(at) };
}

function detectorGrab({ program, light, detectors, changes }: Editing, at: Pointed): Carrier | null {
  const reach = Math.max(at.reach, LOOP_REACH);
  const loop = program?.detectors.find(
    ({ call, bus, place }) =>
      !call && !bus && place.some(([x, y]) => Math.hypot(x - at.x, y - at.y) <= reach),
  );
  const own = detectors.find(({ id }) => id === loop?.label);
  const end = loop?.place.at(-1);
  if (!program || !light || !loop || !own || !end) return null;
  // The lane that it lies in; one of an approach lies in each, which move together.
  const lane = program.lanes
    .map((one) => ({ one, away: nearest(one.line, end)?.away ?? Infinity }))
    .sort((a, b) => a.away - b.away)[0]?.one;
  if (!lane) return null;
  const placed = ({ x, y }: Pointed): LoopPlace =>
    loopOn(lane, nearest(lane.line, [x, y])?.before ?? own.before, own.length);
  return {
    hint: t`Moving detector ${own.id} along its lane`,
    under: (to) => loopHover(placed(to)),
    drop: (to) =>
      changes.change({
        kind: "set_detector",
        junction: light,
        detector: own.id,
        before: placed(to).before,
      }),
  };
}
