import type { LiveActor } from "../api/runs";
import { CATEGORIES } from "../api/types";
import { nth } from "../lists";
import type { Moving } from "../map/scene";
import { type ColourBy, tintOf } from "./tint";

/** A road user as the server introduces it, once. */
export type Introduced = Pick<LiveActor, "index" | "id" | "category" | "length" | "width" | "ego">;

/** One moment of a run; `rows` holds six numbers for each: index, x, y, hdg, speed, flags. */
export interface Frame {
  step: number;
  time: number;
  count: number;
  /** Simulated seconds per second. */
  pace: number;
  arrived: number;
  rows: Float32Array;
  /** How long each row has been stopped so far, seconds, where that is known. */
  stopped?: Float32Array;
  /** What the light ahead of each row shows, where some view wants to know. */
  ahead?: Uint8Array;
}

const HEADER = 5;
const ROW = 6;

/** Reads a binary frame: little-endian float32, a header of five numbers, then six for each. */
export function decodeFrame(data: ArrayBuffer): Frame {
  if (data.byteLength % 4 !== 0 || data.byteLength < 4 * HEADER) {
    throw new Error(`a frame of ${data.byteLength} bytes cannot be read`);
  }
  const all = floats(data);
  const count = nth(all, 2);
  if (all.length !== HEADER + ROW * count) {
    throw new Error(`a frame for ${count} road users has ${all.length} numbers`);
  }
  return {
    step: nth(all, 0),
    time: nth(all, 1),
    count,
    pace: nth(all, 3),
    arrived: nth(all, 4),
    rows: all.subarray(HEADER),
  };
}

const LITTLE = new Uint8Array(new Uint32Array([1]).buffer)[0] === 1;

function floats(data: ArrayBuffer): Float32Array {
  if (LITTLE) return new Float32Array(data);
  const view = new DataView(data);
  return Float32Array.from({ length: data.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, true));
}

/** The road user within a reach of a place, metres, in a frame that was arranged last. */
export function nearest(crowd: Crowd, { pose }: Moving, x: number, y: number, reach: number): string | null {
  let best: string | null = null;
  let least = reach;
  for (const { id } of crowd.all()) {
    const row = crowd.row(id);
    if (row < 0) continue;
    const away = Math.hypot(nth(pose, 5 * row) - x, nth(pose, 5 * row + 1) - y);
    if (away < least) [best, least] = [id, away];
  }
  return best;
}

/** Joins frames with what is known of each road user. */
export class Crowd {
  private readonly known = new Map<number, Introduced>();
  private readonly rowOf = new Map<string, number>();
  private speeds = new Float32Array(0);
  /** Rows of the last frame, as the server sent them, that are drawn. */
  private drawn = new Uint32Array(0);
  /** Added to all places of frames, which are too short for maps far from zero; metres. */
  origin: readonly [number, number] = [0, 0];

  introduce(actors: readonly Introduced[]): void {
    for (const actor of actors) this.known.set(actor.index, actor);
  }

  all(): Introduced[] {
    return [...this.known.values()];
  }

  /** Ids of the road users that are marked as ego. */
  egos(): string[] {
    return this.all()
      .filter((one) => one.ego)
      .map((one) => one.id);
  }

  named(index: number): Introduced | undefined {
    return this.known.get(index);
  }

  /** Row of a road user in the last frame that was {@link arrange}d. */
  row(id: string | null): number {
    return id === null ? -1 : (this.rowOf.get(id) ?? -1);
  }

  /** Speed of a road user in the last frame that was {@link arrange}d, m/s; null if it was not in it. */
  speed(id: string): number | null {
    const row = this.row(id);
    return row < 0 ? null : (this.speeds[row] ?? null);
  }

  /** The frame as it is drawn in every view; those not introduced yet are left out. */
  arrange(frame: Frame, ego: string | null): Moving {
    const pose = new Float64Array(5 * frame.count);
    const category = new Uint8Array(frame.count);
    const flags = new Uint8Array(frame.count);
    const drawn = new Uint32Array(frame.count);
    this.speeds = new Float32Array(frame.count);
    let count = 0;
    this.rowOf.clear();
    for (let i = 0; i < frame.count; i++) {
      const at = ROW * i;
      const who = this.known.get(nth(frame.rows, at));
      if (!who) continue;
      pose[5 * count] = nth(frame.rows, at + 1) + this.origin[0];
      pose[5 * count + 1] = nth(frame.rows, at + 2) + this.origin[1];
      pose[5 * count + 2] = nth(frame.rows, at + 3);
      pose[5 * count + 3] = who.length;
      pose[5 * count + 4] = who.width;
      category[count] = Math.max(CATEGORIES.indexOf(who.category), 0);
      flags[count] = nth(frame.rows, at + 5);
      this.speeds[count] = nth(frame.rows, at + 4);
      drawn[count] = i;
      this.rowOf.set(who.id, count);
      count += 1;
    }
    this.drawn = drawn.subarray(0, count);
    return { count, pose, category, flags, tint: null, ego: this.row(ego), followed: -1 };
  }

  /** The frame that was {@link arrange}d last as one view shows it; places are shared. */
  seen(moving: Moving, frame: Frame, followed: string | null, by: ColourBy): Moving {
    return { ...moving, tint: tintOf(by, frame, this.drawn), followed: this.row(followed) };
  }
}
