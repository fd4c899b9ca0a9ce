import { type RefObject, useCallback, useEffect, useMemo, useState } from "react";

import { type Measured, NOTHING, type Point, withoutLast, withPoint } from "./measure";
import type { MeasureMarks } from "./measureMarks";

/** The measure tool of one map: off, or what it has measured so far. Escape ends it, Backspace takes a point back. */
export interface Measuring {
  measured: Measured | null;
  /** What of it is drawn. */
  marks: MeasureMarks | null;
  toggle: () => void;
  end: () => void;
  point: (at: Point | null) => void;
  /** A click or Enter at a place; `reach` is how near the first point counts as on it, metres. */
  add: (at: Point, reach: number) => void;
}

/** Elements that have Escape and Backspace for themselves: fields, lists, dialogs. */
const OWN_KEYS = "input, textarea, [role=dialog], [role=listbox], [role=menu]";

/** `map` is the one that is measured: keys pressed in another one are not for this. */
export function useMeasure(map: RefObject<HTMLElement | null>): Measuring {
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
      if (event.target instanceof Element) {
        const within = event.target.closest("[role=application]");
        if (event.target.closest(OWN_KEYS) || (within && within !== map.current)) return;
      }
      if (event.key === "Escape") end();
      else if (event.key === "Backspace" || event.key === "Delete") {
        setMeasured((now) => now && withoutLast(now));
      } else return;
      event.preventDefault();
      event.stopPropagation();
    };
    addEventListener("keydown", onKey, true);
    return () => removeEventListener("keydown", onKey, true);
  }, [on, end, map]);
  const marks = useMemo(() => measured && { measured, pointer }, [measured, pointer]);
  return { measured, marks, toggle, end, point, add };
}
