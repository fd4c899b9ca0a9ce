import { t } from "@lingui/core/macro";

import { stationsOf } from "../placing";
import { type Carrier, type Editing, onFoot, placeHover } from "./handler";

/** Takes one along to a free start; the others that are selected come with it. */
export function carrier(editing: Editing, id: string): Carrier {
  const { ones, starts, selection, changes, say } = editing;
  const walk = onFoot(editing, id);
  const others = selection.includes(id) ? selection.filter((other) => other !== id) : [];
  const one = ones.find((each) => each.id === id);
  return {
    hint:
      others.length === 0
        ? t`Moving ${id}: drop it on a free point`
        : t`Moving ${others.length + 1} road users: drop them where ${id} starts`,
    under: ({ x, y, reach }) => {
      const to = starts.near(x, y, reach, walk);
      return placeHover(to, to && one?.goal ? stationsOf({ ...one, spawn: to.id }) : undefined);
    },
    drop: ({ x, y, reach }) => {
      const to = starts.near(x, y, reach, walk);
      if (to) changes.move([id, ...others], to);
      else say(starts.reasonAt(x, y, reach, walk, t`road user`));
    },
  };
}
