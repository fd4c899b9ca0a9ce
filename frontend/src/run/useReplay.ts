import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { runs } from "../api/runs";
import { reasonOf } from "../ui/reason";
import type { Crowd, Frame } from "./frames";
import { Replay } from "./replay";

export interface Player {
  replay: Replay | null;
  loading: boolean;
  /** Why there is nothing to play. */
  error: string | null;
  time: number;
  playing: boolean;
  speed: number;
  play: () => void;
  pause: () => void;
  seek: (time: number) => void;
  setSpeed: (speed: number) => void;
}

/** Plays a recorded run; it is fetched when `wanted`. */
export function useReplay(run: string, wanted: boolean, show: (frame: Frame, crowd: Crowd) => void): Player {
  const [replay, setReplay] = useState<Replay | null>(null);
  const [error, setError] = useState<string | null>(null);
  const [time, setTime] = useState(0);
  const [playing, setPlaying] = useState(false);
  const [speed, setSpeed] = useState(1);
  const clock = useRef(0);

  useEffect(() => {
    if (!wanted) return;
    let current = true;
    runs.replay(run).then(
      (columns) => {
        if (!current) return;
        const made = new Replay(columns);
        setReplay(made);
        clock.current = made.begin;
        setTime(made.begin);
        show(made.at(made.begin), made.crowd);
      },
      (reason: unknown) => {
        if (current) setError(reasonOf(reason));
      },
    );
    return () => {
      current = false;
    };
  }, [run, wanted, show]);

  const seek = useCallback(
    (to: number) => {
      if (!replay) return;
      clock.current = Math.min(replay.end, Math.max(replay.begin, to));
      setTime(clock.current);
      show(replay.at(clock.current), replay.crowd);
    },
    [replay, show],
  );

  useEffect(() => {
    if (!playing || !replay) return;
    let pending = 0;
    let before = performance.now();
    const tick = (wall: number): void => {
      seek(clock.current + ((wall - before) / 1000) * speed);
      before = wall;
      if (clock.current >= replay.end) setPlaying(false);
      else pending = requestAnimationFrame(tick);
    };
    pending = requestAnimationFrame((wall) => {
      before = wall;
      tick(wall);
    });
    return () => cancelAnimationFrame(pending);
  }, [playing, replay, speed, seek]);

  const play = useCallback(() => {
    if (replay && clock.current >= replay.end) seek(replay.begin);
    setPlaying(true);
  }, [replay, seek]);
  const pause = useCallback(() => setPlaying(false), []);
  return useMemo(
    () => ({
      replay,
      loading: wanted && !replay && !error,
      error,
      time,
      playing,
      speed,
      play,
      pause,
      seek,
      setSpeed,
    }),
    [replay, wanted, error, time, playing, speed, play, pause, seek],
  );
}
