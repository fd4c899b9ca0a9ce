import type { ReplayColumns } from "../api/runs";
import type { Bounds } from "../api/types";
import { MOST_ACTORS } from "../editor/scene";
import { nth } from "../lists";
import { Crowd, type Frame } from "./frames";
import type { LimitOf } from "./limits";
import type { SpeedPoint } from "./SpeedChart";
import { STOPPED } from "./tint";

const ROW = 6;

/** Columns of who was where: lists, or typed arrays of what came in binary. */
export type MovedColumns = Pick<ReplayColumns, "actors"> &
  Record<Exclude<keyof ReplayColumns, "actors">, ArrayLike<number>>;

/** A recorded run that can be shown at any time; between two moments places are interpolated. */
export class Replay {
  readonly crowd = new Crowd();
  readonly begin: number;
  /** When the last road user has left, or the recording ends. */
  readonly end: number;
  /** Seconds between two recorded moments. */
  readonly spacing: number;
  /** The same road user's row in the next moment, or -1. */
  private readonly next: Int32Array;
  /** How long each row's road user has been stopped before, seconds. */
  private readonly stopped: Float32Array;

  constructor(private readonly columns: MovedColumns) {
    const { times, x, y } = columns;
    this.begin = times[0] ?? 0;
    const last = times.length - 1;
    this.spacing = last > 0 ? ((times[last] ?? 0) - this.begin) / last : 0;
    // What follows once the last has arrived is an empty road.
    this.end = times[Math.min(lastBusy(columns) + 1, last)] ?? 0;
    this.next = following(columns);
    this.stopped = stoppedSoFar(columns, this.next);
    this.crowd.origin = [Math.round(x[0] ?? 0), Math.round(y[0] ?? 0)];
    this.crowd.introduce(columns.actors.map((actor, index) => ({ ...actor, index })));
  }

  /** The recorded moments. */
  get times(): ArrayLike<number> {
    return this.columns.times;
  }

  /** All on the road at a time, as a live frame has them; `arrived` is not known. */
  at(time: number): Frame {
    const { times, first, actor, x, y, hdg, speed } = this.columns;
    if (times.length === 0)
      return { step: 0, time, count: 0, pace: 0, arrived: 0, rows: new Float32Array(0) };
    const i = momentAt(times, time);
    const count = nth(first, i + 1) - nth(first, i);
    const rows = new Float32Array(ROW * count);
    const stopped = this.stopped.slice(nth(first, i), nth(first, i) + count);
    const span = i + 1 < times.length ? nth(times, i + 1) - nth(times, i) : 0;
    const share = span > 0 ? Math.min(1, Math.max(0, (time - nth(times, i)) / span)) : 0;
    for (let k = 0; k < count; k++) {
      const a = nth(first, i) + k;
      const b = nth(this.next, a);
      let pose: Pose = { x: nth(x, a), y: nth(y, a), hdg: nth(hdg, a), speed: nth(speed, a) };
      if (b >= 0 && share > 0)
        pose = between(
          pose,
          { x: nth(x, b), y: nth(y, b), hdg: nth(hdg, b), speed: nth(speed, b) },
          span,
          share,
        );
      rows.set(
        [
          nth(actor, a),
          pose.x - this.crowd.origin[0],
          pose.y - this.crowd.origin[1],
          pose.hdg,
          pose.speed,
          0,
        ],
        ROW * k,
      );
    }
    return { step: i, time, count, pace: 0, arrived: 0, rows, stopped };
  }

  /** Where all of them have been, if they are few enough for a story; metres. */
  extent(): Bounds | null {
    const { actors, x, y } = this.columns;
    if (actors.length === 0 || actors.length > MOST_ACTORS) return null;
    const bounds: Bounds = [Infinity, Infinity, -Infinity, -Infinity];
    for (let row = 0; row < x.length; row++) {
      bounds[0] = Math.min(bounds[0], nth(x, row));
      bounds[1] = Math.min(bounds[1], nth(y, row));
      bounds[2] = Math.max(bounds[2], nth(x, row));
      bounds[3] = Math.max(bounds[3], nth(y, row));
    }
    return bounds;
  }

  /** Speeds of a road user at all moments at which it is on the road, with limits where they are known. */
  speedsOf(id: string, limitOf?: LimitOf | null): SpeedPoint[] {
    const { times, first, actor, actors, speed, x, y, hdg } = this.columns;
    const wanted = actors.findIndex((one) => one.id === id);
    const points: SpeedPoint[] = [];
    for (let i = 0; i < times.length; i++)
      for (let row = nth(first, i); row < nth(first, i + 1); row++)
        if (actor[row] === wanted)
          points.push({
            time: nth(times, i),
            speed: nth(speed, row),
            ...(limitOf && { limit: limitOf(nth(x, row), nth(y, row), nth(hdg, row)) }),
          });
    return points;
  }
}

interface Pose {
  x: number;
  y: number;
  hdg: number;
  speed: number;
}

/**
 * Place between two that are `span` seconds apart, along a curve that leaves and arrives with the
 * recorded heading and speed. One that was put elsewhere stays until then.
 */
export function between(a: Pose, b: Pose, span: number, share: number): Pose {
  const far = Math.hypot(b.x - a.x, b.y - a.y);
  if (far > 2 * span * Math.max(a.speed, b.speed) + 10) return a;
  const t = share;
  const [h0, h1] = [(1 + 2 * t) * (1 - t) ** 2, t * t * (3 - 2 * t)];
  const [d0, d1] = [t * (1 - t) ** 2 * span * a.speed, t * t * (t - 1) * span * b.speed];
  const turn = Math.atan2(Math.sin(b.hdg - a.hdg), Math.cos(b.hdg - a.hdg));
  return {
    x: h0 * a.x + h1 * b.x + d0 * Math.cos(a.hdg) + d1 * Math.cos(b.hdg),
    y: h0 * a.y + h1 * b.y + d0 * Math.sin(a.hdg) + d1 * Math.sin(b.hdg),
    hdg: a.hdg + turn * t,
    speed: a.speed + (b.speed - a.speed) * t,
  };
}

/** Last moment that is not after `time`; the first one before all. */
export function momentAt(times: ArrayLike<number>, time: number): number {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (nth(times, middle) <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Of each row, for how long its road user was stopped up to then; moments not recorded do not count. */
function stoppedSoFar({ times, first, speed }: MovedColumns, next: Int32Array): Float32Array {
  const seconds = new Float32Array(next.length);
  for (let i = 0; i + 1 < times.length; i++) {
    const span = nth(times, i + 1) - nth(times, i);
    for (let row = nth(first, i); row < nth(first, i + 1); row++) {
      const after = nth(next, row);
      if (after >= 0) seconds[after] = nth(seconds, row) + (nth(speed, after) < STOPPED ? span : 0);
    }
  }
  return seconds;
}

/** The last moment at which there are road users; the very last one if there are none at all. */
function lastBusy({ times, first }: MovedColumns): number {
  for (let i = times.length - 1; i >= 0; i--) if (nth(first, i + 1) > nth(first, i)) return i;
  return times.length - 1;
}

function following({ first, actor, actors }: MovedColumns): Int32Array {
  const next = new Int32Array(actor.length).fill(-1);
  const last = new Int32Array(actors.length).fill(-1);
  for (let i = 0; i + 1 < first.length; i++) {
    for (let row = nth(first, i); row < nth(first, i + 1); row++) {
      const before = nth(last, nth(actor, row));
      if (i > 0 && before >= nth(first, i - 1)) next[before] = row;
      last[nth(actor, row)] = row;
    }
  }
  return next;
}
