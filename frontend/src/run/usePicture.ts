import { type RefObject, useCallback, useEffect, useMemo, useRef, useState } from "react";

import { nth } from "../lists";
import type { MapHandle, Pointed } from "../map/MapCanvas";
import type { Moving } from "../map/scene";
import { type Crowd, type Frame, nearest } from "./frames";
import type { LimitOf } from "./limits";
import type { SpeedPoint } from "./SpeedChart";
import { StoppedDelay } from "./tint";
import type { RunSight } from "./views";

/** Wall milliseconds between two updates of the figures; the map itself is drawn with every frame. */
const READABLE = 150;

export interface Now {
  time: number;
  pace: number;
  running: number;
  arrived: number;
  /** Who is followed in some view and on the road. */
  there: ReadonlySet<string>;
}

/** The newest picture of a run, live or recorded, in all its views. */
export interface Picture {
  now: Now;
  show: (frame: Frame, crowd: Crowd) => void;
  /** Once more, on a map that has just come. */
  redraw: () => void;
  clear: () => void;
  /** The road user near a point. */
  near: (at: Pointed) => string | null;
  /** Speeds of one that is followed, as they were seen. */
  speedsOf: (id: string) => readonly SpeedPoint[];
  /** The newest frame, read when it is needed. */
  latest: () => { frame: Frame; crowd: Crowd } | null;
}

/** Points of a chart of speeds that are kept. */
const MOST_POINTS = 2400;

/** One more point of the speeds that were seen, unless no time has passed. */
function note(points: SpeedPoint[], point: SpeedPoint): void {
  if (point.time <= (points.at(-1)?.time ?? -1)) return;
  points.push(point);
  if (points.length > MOST_POINTS) points.splice(0, points.length - MOST_POINTS);
}

export function usePicture(
  views: readonly RunSight[],
  handleOf: (id: number) => RefObject<MapHandle | null>,
  limitOf: LimitOf | null,
  aheadOf: ((frame: Frame, crowd: Crowd) => Frame) | null,
): Picture {
  const [now, setNow] = useState<Now>({ time: 0, pace: 0, running: 0, arrived: 0, there: new Set() });
  const last = useRef<{ frame: Frame; crowd: Crowd; moving: Moving } | null>(null);
  const shown = useRef(views);
  shown.current = views;
  const limits = useRef(limitOf);
  limits.current = limitOf;
  const lights = useRef(aheadOf);
  lights.current = aheadOf;
  const delays = useRef(new StoppedDelay());
  const speeds = useRef(new Map<string, SpeedPoint[]>());
  const pending = useRef(0);

  const show = useCallback(
    (seen: Frame, crowd: Crowd) => {
      let frame = delays.current.learn(seen);
      // It is looked up for each vehicle: only if a view shows it.
      if (shown.current.some(({ by }) => by === "signal")) frame = lights.current?.(frame, crowd) ?? frame;
      const moving = crowd.arrange(frame, crowd.egos()[0] ?? null);
      last.current = { frame, crowd, moving };
      for (const { id, followed, by } of shown.current) {
        const mine = crowd.seen(moving, frame, followed, by);
        const handle = handleOf(id).current;
        handle?.setMoving(mine);
        const row = mine.followed;
        if (row >= 0) handle?.centre(nth(moving.pose, 5 * row), nth(moving.pose, 5 * row + 1));
      }
      for (const [user, points] of speeds.current) {
        const [speed, row] = [crowd.speed(user), crowd.row(user)];
        if (speed === null) continue;
        const [x, y, hdg] = [0, 1, 2].map((k) => nth(moving.pose, 5 * row + k)) as [number, number, number];
        note(points, { time: frame.time, speed, limit: limits.current?.(x, y, hdg) ?? null });
      }
      pending.current ||= window.setTimeout(() => {
        pending.current = 0;
        if (!last.current) return;
        const {
          frame: { time, pace, count, arrived },
          crowd: newest,
        } = last.current;
        const there = new Set([...speeds.current.keys()].filter((user) => newest.row(user) >= 0));
        setNow({ time, pace, running: count, arrived, there });
      }, READABLE);
    },
    [handleOf],
  );
  const redraw = useCallback(() => {
    if (last.current) show(last.current.frame, last.current.crowd);
  }, [show]);
  useEffect(() => {
    const followed = new Set(views.map((one) => one.followed));
    for (const user of speeds.current.keys()) if (!followed.has(user)) speeds.current.delete(user);
    for (const user of followed) if (user !== null && !speeds.current.has(user)) speeds.current.set(user, []);
    redraw();
  }, [views, aheadOf, redraw]);
  const clear = useCallback(() => {
    last.current = null;
    for (const { id } of shown.current) handleOf(id).current?.setMoving(null);
    setNow((old) => ({ ...old, running: 0, there: new Set() }));
  }, [handleOf]);
  const near = useCallback((at: Pointed): string | null => {
    if (!last.current) return null;
    const { crowd, moving } = last.current;
    return nearest(crowd, moving, at.x, at.y, Math.max(at.reach, 3));
  }, []);
  const speedsOf = useCallback((id: string) => speeds.current.get(id) ?? [], []);
  const latest = useCallback(() => last.current, []);
  return useMemo(
    () => ({ now, show, redraw, clear, near, speedsOf, latest }),
    [now, show, redraw, clear, near, speedsOf, latest],
  );
}
