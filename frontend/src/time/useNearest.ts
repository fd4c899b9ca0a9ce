import { useCallback, useEffect, useRef, useState } from "react";

import type { Crowd, Frame } from "../run/frames";
import type { Replay } from "../run/replay";
import { nth } from "../lists";
import { type Nearest, nearestOf } from "./collision";

/** Milliseconds of computing at a time, so that the page stays responsive. */
const TURN = 12;
/** Simulated seconds between two values of a live run. */
const APART = 0.2;

export interface EgoTtc {
  /** Whose it is; null without an ego. */
  ego: string | null;
  points: readonly Nearest[];
  /** Takes in a frame of a live run. */
  learn: (frame: Frame, crowd: Crowd) => void;
}

/** Time to collision of the ego: of a recording all of it, of a live run as it comes. */
export function useNearest(replay: Replay | null, live: Crowd | null): EgoTtc {
  const [recorded, setRecorded] = useState<readonly Nearest[]>([]);
  const seen = useRef<Nearest[]>([]);
  const ego = (replay?.crowd ?? live)?.egos()[0] ?? null;
  useEffect(() => {
    setRecorded([]);
    if (!replay || ego === null) return;
    const found: Nearest[] = [];
    let [next, timer] = [0, 0];
    const work = (): void => {
      const until = performance.now() + TURN;
      while (next < replay.times.length && performance.now() < until) {
        const one = nearestOf(replay.at(nth(replay.times, next)), replay.crowd, ego);
        if (one) found.push(one);
        next += 1;
      }
      if (next < replay.times.length) timer = window.setTimeout(work);
      else setRecorded(found);
    };
    timer = window.setTimeout(work);
    return () => clearTimeout(timer);
  }, [replay, ego]);
  const learn = useCallback((frame: Frame, crowd: Crowd) => {
    const id = crowd.egos()[0];
    const last = seen.current.at(-1);
    if (id === undefined || (last && frame.time < last.time + APART)) return;
    const one = nearestOf(frame, crowd, id);
    if (one) seen.current.push(one);
  }, []);
  return { ego, points: replay ? recorded : seen.current, learn };
}
