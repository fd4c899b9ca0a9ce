import { t } from "@lingui/core/macro";

import type { Pointed } from "../../map/MapCanvas";
import type { PlaceNames } from "../../map/placeNames";
import { type Editing, type Handler, type Hover, LOOKING } from "./handler";
import { goalAt, oneAt } from "./select";

/** Besides what a handler does: a click on a traffic light shows its program. */
export function withLights(handler: Handler, editing: Editing): Handler {
  const { lights, showLight } = editing;
  return {
    ...handler,
    under: (at) => {
      const junction = lights?.junctionAt(at) ?? null;
      return lightHover(junction) ?? handler.under(at);
    },
    hint: (hover) => (hover?.is === "light" ? lightWords(hover, editing.graph.names) : handler.hint(hover)),
    pick: (at) => {
      // Road users and goals that lie on a stop line come first.
      const junction = oneAt(editing, at) || goalAt(editing, at) ? null : lights?.junctionAt(at);
      if (junction) showLight(junction);
      else handler.pick(at);
    },
  };
}

/** A click this near to a signal means its junction where nothing else is meant, metres. */
const REACH = 40;

/** Where only lights are chosen: a click anywhere on a junction shows its program. */
export const lightsHandler = (editing: Editing): Handler => {
  const { lights, showLight } = editing;
  const there = (at: Pointed): string | null =>
    lights?.junctionAt({ ...at, reach: Math.max(at.reach, REACH) }) ?? null;
  return {
    ...LOOKING,
    aim: true,
    under: (at) => lightHover(there(at)),
    hint: (hover) =>
      hover?.is === "light"
        ? lightWords(hover, editing.graph.names)
        : lights && lights.junctions.length > 0
          ? t`Click a junction with a traffic light to see its program`
          : null,
    pick: (at) => {
      const junction = there(at);
      if (junction !== null) showLight(junction);
    },
  };
};

export const lightHover = (junction: string | null): Hover | null =>
  junction === null ? null : { is: "light", junction };

export const lightWords = ({ junction }: Extract<Hover, { is: "light" }>, names: PlaceNames): string =>
  t`Traffic light at ${names.junction(junction)}: click to see its program`;
