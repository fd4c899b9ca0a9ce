import { t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import type { Category } from "../../api/types";
import type { Place } from "../../map/graph";
import { lengthText } from "../../language/units";
import type { BodySize } from "../placing";
import { laneWord } from "../placeWords";
import { type Editing, type Hover, LOOKING, placeHover, type ToolHandler } from "./handler";
import { choose, oneAt, selectFrame } from "./select";

/** What tools differ in that use up starts of the region. */
interface Starting {
  walks: boolean;
  badge: Category | null;
  /** Who starts there, for messages: `bus`, `flow`. */
  who: string;
  /** Said while nothing is under the pointer. */
  prompt: string;
  /** The body for which there is to be room. */
  size?: BodySize | null;
  apply: (to: Place) => void;
}

/** From so many metres on it is said that another point was taken than the one that was meant. */
const FAR = 3;

/** A click on a free start uses it, whatever goals lie there; a click on a road user selects. */
export function startingHandler(
  editing: Editing,
  { walks, badge, who, prompt, size, apply }: Starting,
): ToolHandler {
  const { graph, starts, ones, roi, say, openStep } = editing;
  return {
    ...LOOKING,
    aim: true,
    walks,
    badge,
    under: ({ x, y, reach }) => placeHover(starts.near(x, y, reach, walks, { size })),
    hint: (hover) => (hover?.is === "place" ? whereabouts(editing, hover) : prompt),
    pick: (at) => {
      const there = oneAt(editing, at);
      if (there !== null) choose(editing, there, at.shift);
      else {
        const to = starts.near(at.x, at.y, at.reach, walks, { size });
        if (to) {
          apply(to);
          const away = starts.beyond(at.x, at.y, at.reach, to);
          if (away > FAR)
            say(t`There is no room there: the next free point, ${lengthText(away)} away, was taken.`);
        } else if (roi.length === 0) openStep("region");
        else say(starts.reasonAt(at.x, at.y, at.reach, walks, who));
      }
    },
    frame: (area) => selectFrame(editing, area),
    somewhere: () => {
      const to = starts.first(
        walks,
        ones.flatMap((one) => graph.place(one.spawn) ?? []),
      );
      if (to) apply(to);
      else say(t`No free point is left inside the region.`);
    },
  };
}

/** Lane and compass heading of a start. */
function whereabouts({ graph }: Editing, { place }: Extract<Hover, { is: "place" }>): string {
  const degrees = Math.round((((90 - (place.hdg * 180) / Math.PI) % 360) + 360) % 360);
  return `${laneWord(graph, place.id)}${place.walk ? "" : t`, heading ${degrees}°`}`;
}

/** The button for those who do not point. */
export const NEXT_POINT = localized(() => t`Use the next free point`);

/** What is said beside the map of a tool that makes something new. */
export const startHelp = (who: string, walks: boolean): string =>
  walks
    ? t`Now click where the ${who} starts, on a sidewalk or crosswalk. Escape stops placing.`
    : t`Now click where the ${who} starts, on a lane. Escape stops placing.`;

/** What is said on the map of a tool that makes something new. */
export const startPrompt = (who: string, walks: boolean): string =>
  walks
    ? t`Point at the edge of a road where the ${who} starts`
    : t`Point at the lane where the ${who} starts`;
