import { useCallback, useEffect, useMemo, useState } from "react";

import { runs } from "../api/runs";
import { reasonOf } from "../ui/reason";
import type { Crowd, Frame } from "./frames";
import { Replay } from "./replay";
import { type Playing, usePlaying } from "./usePlaying";

export interface Player extends Playing {
  replay: Replay | null;
  loading: boolean;
  /** Why there is nothing to play. */
  error: string | null;
}

/** Plays a recorded run; it is fetched when `wanted`. */
export function useReplay(run: string, wanted: boolean, show: (frame: Frame, crowd: Crowd) => void): Player {
  const [replay, setReplay] = useState<Replay | null>(null);
  const [error, setError] = useState<string | null>(null);
  const showAt = useCallback((time: number) => replay && show(replay.at(time), replay.crowd), [replay, show]);
  const playing = usePlaying(replay, showAt);
  const { start } = playing;

  useEffect(() => {
    if (!wanted) return;
    let current = true;
    runs.replay(run).then(
      (columns) => {
        if (!current) return;
        const made = new Replay(columns);
        setReplay(made);
        start(made.begin);
        show(made.at(made.begin), made.crowd);
      },
      (reason: unknown) => {
        if (current) setError(reasonOf(reason));
      },
    );
    return () => {
      current = false;
    };
  }, [run, wanted, show, start]);

  return useMemo(
    () => ({ ...playing, replay, loading: wanted && !replay && !error, error }),
    [playing, replay, wanted, error],
  );
}
