import { type Carrier, type Editing, onFoot, placeHover } from "./handler";

/** Takes one along to a free start; the others that are selected come with it. */
export function carrier(editing: Editing, id: string): Carrier {
  const { starts, selection, changes, say } = editing;
  const walk = onFoot(editing, id);
  const others = selection.includes(id) ? selection.filter((other) => other !== id) : [];
  return {
    under: ({ x, y, reach }) => placeHover(starts.near(x, y, reach, walk)),
    drop: ({ x, y, reach }) => {
      const to = starts.near(x, y, reach, walk);
      if (to) changes.move([id, ...others], to);
      else say(starts.reasonAt(x, y, reach, walk, "road user"));
    },
  };
}
