import { useCallback, useEffect, useState } from "react";

import { type Measured, NOTHING, type Point, withoutLast, withPoint } from "./measure";

/** The measure tool of one map: off, or what it has measured so far. Escape ends it, Backspace takes a point back. */
export interface Measuring {
  measured: Measured | null;
  /** Where the pointer is, to which a line leads that is not measured yet. */
  pointer: Point | null;
  toggle: () => void;
  end: () => void;
  point: (at: Point | null) => void;
  /** A click or Enter at a place; `reach` is how near the first point counts as on it, metres. */
  add: (at: Point, reach: number) => void;
}

export function useMeasure(): Measuring {
  const [measured, setMeasured] = useState<Measured | null>(null);
  const [pointer, point] = useState<Point | null>(null);
  const end = useCallback(() => setMeasured(null), []);
  const toggle = useCallback(() => {
    point(null);
    setMeasured((now) => (now ? null : NOTHING));
  }, []);
  const add = useCallback(
    (at: Point, reach: number) => setMeasured((now) => now && withPoint(now, at, reach)),
    [],
  );
  const on = measured !== null;
  // Before anything else hears of them: what is selected in the editor stays.
  useEffect(() => {
    if (!on) return;
    const onKey = (event: KeyboardEvent): void => {
      if (event.target instanceof Element && event.target.closest("input, textarea")) return;
      if (event.key === "Escape") end();
      else if (event.key === "Backspace" || event.key === "Delete") {
        setMeasured((now) => now && withoutLast(now));
      } else return;
      event.preventDefault();
      event.stopPropagation();
    };
    addEventListener("keydown", onKey, true);
    return () => removeEventListener("keydown", onKey, true);
  }, [on, end]);
  return { measured, pointer, toggle, end, point, add };
}
