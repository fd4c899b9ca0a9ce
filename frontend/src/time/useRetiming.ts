import { useCallback, useEffect, useRef, useState } from "react";

import type { ScenarioDocument } from "../api/types";
import type { Changes } from "../editor/changes";
import { type Block, editOf, type Grip, keyOf, moved, type Times } from "./blocks";

/** Milliseconds without a further key before a change by keys is sent, so that it is one step for undo. */
const QUIET = 500;

export interface Retiming {
  /** Where a block is now: as it is held, or as the document has it. */
  timesOf: (block: Block) => Times;
  /** Shows a block moved by so many seconds, without changing the document. */
  hold: (block: Block, grip: Grip, by: number) => void;
  /** Makes what is held a change. */
  drop: () => void;
  /** Puts it back. */
  putBack: () => void;
  /** Moves a block on from where it is; sent once the keys rest. */
  nudge: (block: Block, grip: Grip, by: number) => void;
}

/** Blocks of the time bar that are being moved; a drag, or some keys in a row, are one edit. */
export function useRetiming(document: ScenarioDocument, changes: Changes, longest: number): Retiming {
  const [held, setHeld] = useState<{ block: Block; times: Times } | null>(null);
  const latest = useRef({ document, held, changes });
  const timer = useRef(0);
  useEffect(() => {
    latest.current = { ...latest.current, document, changes };
  });
  const put = useCallback((next: { block: Block; times: Times } | null) => {
    latest.current.held = next;
    setHeld(next);
  }, []);
  const drop = useCallback(() => {
    clearTimeout(timer.current);
    const { held: now, document: scenario, changes: asked } = latest.current;
    if (!now) return;
    const { block, times } = now;
    const same = times.begin === block.begin && times.end === block.end;
    const wanted = same ? null : editOf(scenario, block, times);
    if (!wanted) {
      put(null);
      return;
    }
    // It stays where it was put until the document has it there, or it was refused.
    void asked.retime(wanted.edit, wanted.label).then(() => {
      if (latest.current.held === now) put(null);
    });
  }, [put]);
  // What was moved by keys is not lost with the bar.
  useEffect(() => () => drop(), [drop]);
  const hold = useCallback(
    (block: Block, grip: Grip, by: number) => {
      const other = latest.current.held;
      if (other && keyOf(other.block) !== keyOf(block)) drop();
      put({ block, times: moved(block, grip, by, longest) });
    },
    [drop, put, longest],
  );
  const nudge = useCallback(
    (block: Block, grip: Grip, by: number) => {
      const other = latest.current.held;
      const going = other && keyOf(other.block) === keyOf(block);
      if (other && !going) drop();
      put({
        block: going ? other.block : block,
        times: moved(going ? other.times : block, grip, by, longest),
      });
      clearTimeout(timer.current);
      timer.current = window.setTimeout(drop, QUIET);
    },
    [drop, put, longest],
  );
  const timesOf = (block: Block): Times =>
    held && keyOf(held.block) === keyOf(block) ? held.times : { begin: block.begin, end: block.end };
  return { timesOf, hold, drop, putBack: useCallback(() => put(null), [put]), nudge };
}
