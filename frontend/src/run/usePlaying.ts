import { useCallback, useEffect, useMemo, useRef, useState } from "react";

/** The moment of a recording that is shown, and what moves it. */
export interface Playing {
  time: number;
  playing: boolean;
  speed: number;
  play: () => void;
  pause: () => void;
  seek: (time: number) => void;
  setSpeed: (speed: number) => void;
  /** Sets the moment of what is shown already. */
  start: (time: number) => void;
}

/** Plays from `begin` to `end` of a range, at so many seconds a second; `show` draws a moment. */
export function usePlaying(
  range: { begin: number; end: number } | null,
  show: (time: number) => void,
): Playing {
  const [time, setTime] = useState(0);
  const [playing, setPlaying] = useState(false);
  const [speed, setSpeed] = useState(1);
  const clock = useRef(0);
  const start = useCallback((to: number) => {
    clock.current = to;
    setTime(to);
  }, []);
  const seek = useCallback(
    (to: number) => {
      if (!range) return;
      start(Math.min(range.end, Math.max(range.begin, to)));
      show(clock.current);
    },
    [range, show, start],
  );

  useEffect(() => {
    if (!playing || !range) return;
    let pending = 0;
    let before = performance.now();
    const tick = (wall: number): void => {
      seek(clock.current + ((wall - before) / 1000) * speed);
      before = wall;
      if (clock.current >= range.end) setPlaying(false);
      else pending = requestAnimationFrame(tick);
    };
    pending = requestAnimationFrame((wall) => {
      before = wall;
      tick(wall);
    });
    return () => cancelAnimationFrame(pending);
  }, [playing, range, speed, seek]);

  const play = useCallback(() => {
    if (range && clock.current >= range.end) seek(range.begin);
    setPlaying(true);
  }, [range, seek]);
  const pause = useCallback(() => setPlaying(false), []);
  return useMemo(
    () => ({ time, playing, speed, play, pause, seek, setSpeed, start }),
    [time, playing, speed, play, pause, seek, start],
  );
}
