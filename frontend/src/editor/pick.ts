import { type RefObject, useEffect, useMemo, useRef, useState } from "react";

/**
 * What a click on the map names while a place is picked: `loop` a lane before the light that is shown,
 * `node` a node of a lane of the region, `goal` any node of a lane or walkway, `place` that or where
 * there is none the ground, `ground` x and y.
 */
export type PickBy =
  "segment" | "lane" | "turn" | "point" | "light" | "loop" | "node" | "goal" | "place" | "ground";

/** A place that was pointed at. */
export interface Picked {
  /** Empty of the ground. */
  name: string;
  /** Of a point of a lane how far along the road it is, of a loop how far before the stop line; metres. */
  s: number;
  /** Metres, and radians counter-clockwise; of places that are points. */
  x: number;
  y: number;
  hdg: number;
}

/** A place that has only a name. */
export const namedPlace = (name: string, s = 0): Picked => ({ name, s, x: 0, y: 0, hdg: 0 });

interface Picking {
  /** For whom: the same key is the same form. */
  key: string;
  by: PickBy;
  /** The first segment of a turn that is half picked. */
  from: string | null;
}

/** Places picked on the map for a form. */
export interface PlacePick {
  now: Picking | null;
  start: (key: string, by: PickBy) => void;
  stop: () => void;
  /** Keeps the first segment of a turn. */
  begin: (from: string) => void;
  taker: RefObject<(picked: Picked) => void>;
}

export function usePick(): PlacePick {
  const [now, setNow] = useState<Picking | null>(null);
  const taker = useRef<(picked: Picked) => void>(() => undefined);
  return useMemo(
    () => ({
      now,
      start: (key, by) => setNow({ key, by, from: null }),
      stop: () => setNow(null),
      begin: (from) => setNow((old) => old && { ...old, from }),
      taker,
    }),
    [now],
  );
}

/** Takes what is picked for `key`, always with what the form knows now. */
export function useTaking(pick: PlacePick, key: string, take: (picked: Picked) => void): boolean {
  const active = pick.now?.key === key;
  useEffect(() => {
    if (active) pick.taker.current = take;
  });
  return active;
}
