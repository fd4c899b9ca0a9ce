import { type RefObject, useCallback, useMemo, useRef, useState } from "react";

import { nth } from "../lists";
import type { MapHandle, Pointed } from "../map/MapCanvas";
import type { Moving } from "../map/scene";
import type { Crowd, Frame } from "./frames";
import type { SpeedPoint } from "./SpeedChart";
import { type ColourBy, StoppedDelay } from "./tint";

/** Wall milliseconds between two updates of the figures; the map itself is drawn with every frame. */
const READABLE = 150;

export interface Now {
  time: number;
  pace: number;
  running: number;
  arrived: number;
  /** Whether the one that is followed is on the road. */
  there: boolean;
}

/** The newest picture of a run, live or recorded, and who is followed in it. */
export interface Picture {
  now: Now;
  followed: string | null;
  show: (frame: Frame, crowd: Crowd) => void;
  /** Once more, on a map that has just come. */
  redraw: () => void;
  clear: () => void;
  follow: (id: string | null) => void;
  /** The road user near a point. */
  near: (at: Pointed) => string | null;
  /** What colours say. */
  by: ColourBy;
  colourBy: (by: ColourBy) => void;
  /** Speeds of the one that is followed, as they were seen. */
  speeds: readonly SpeedPoint[];
  /** The newest frame, read when it is needed. */
  latest: () => { frame: Frame; crowd: Crowd } | null;
}

/** Points of the chart of speeds that are kept. */
const MOST_POINTS = 2400;

/** One more point of the speeds that were seen, unless no time has passed. */
function note(points: SpeedPoint[], time: number, speed: number | null): void {
  if (speed === null || time <= (points.at(-1)?.time ?? -1)) return;
  points.push({ time, speed });
  if (points.length > MOST_POINTS) points.splice(0, points.length - MOST_POINTS);
}

export function usePicture(handle: RefObject<MapHandle | null>): Picture {
  const [now, setNow] = useState<Now>({ time: 0, pace: 0, running: 0, arrived: 0, there: false });
  const [followed, setFollowed] = useState<string | null>(null);
  const last = useRef<{ frame: Frame; crowd: Crowd; moving: Moving } | null>(null);
  const watched = useRef<string | null>(null);
  const [by, setBy] = useState<ColourBy>("kind");
  const colours = useRef<ColourBy>("kind");
  const delays = useRef(new StoppedDelay());
  const speeds = useRef<SpeedPoint[]>([]);
  const pending = useRef(0);

  const show = useCallback(
    (seen: Frame, crowd: Crowd) => {
      const frame = delays.current.learn(seen);
      const moving = crowd.arrange(frame, crowd.egos()[0] ?? null, watched.current, colours.current);
      note(speeds.current, frame.time, watched.current === null ? null : crowd.speed(watched.current));
      last.current = { frame, crowd, moving };
      handle.current?.setMoving(moving);
      const row = moving.followed;
      if (row >= 0) handle.current?.centre(nth(moving.pose, 5 * row), nth(moving.pose, 5 * row + 1));
      pending.current ||= window.setTimeout(() => {
        pending.current = 0;
        if (!last.current) return;
        const {
          frame: { time, pace, count, arrived },
          moving: { followed: row },
        } = last.current;
        setNow({ time, pace, running: count, arrived, there: row >= 0 });
      }, READABLE);
    },
    [handle],
  );
  const redraw = useCallback(() => {
    if (last.current) show(last.current.frame, last.current.crowd);
  }, [show]);
  const clear = useCallback(() => {
    last.current = null;
    handle.current?.setMoving(null);
    setNow((old) => ({ ...old, running: 0, there: false }));
  }, [handle]);
  const follow = useCallback(
    (id: string | null) => {
      watched.current = id;
      speeds.current = [];
      setFollowed(id);
      redraw();
    },
    [redraw],
  );
  const near = useCallback((at: Pointed): string | null => {
    if (!last.current) return null;
    const { crowd, moving } = last.current;
    let best: string | null = null;
    let least = Math.max(at.reach, 3);
    for (const { id } of crowd.all()) {
      const row = crowd.row(id);
      if (row < 0) continue;
      const away = Math.hypot(nth(moving.pose, 5 * row) - at.x, nth(moving.pose, 5 * row + 1) - at.y);
      if (away < least) [best, least] = [id, away];
    }
    return best;
  }, []);
  const colourBy = useCallback(
    (next: ColourBy) => {
      colours.current = next;
      setBy(next);
      redraw();
    },
    [redraw],
  );
  const latest = useCallback(() => last.current, []);
  return useMemo(
    () => ({
      now,
      followed,
      show,
      redraw,
      clear,
      follow,
      near,
      latest,
      by,
      colourBy,
      speeds: speeds.current,
    }),
    [now, followed, show, redraw, clear, follow, near, latest, by, colourBy],
  );
}
