import type { DayPlan } from "../api/signals";
import { nth } from "../lists";

/** A stage in the ring: its green, and what is between it and the next one; seconds. */
export interface RingPart {
  stage: string;
  green: number;
  between: number;
  onCall: boolean;
}

/** The cycle of a plan as a bar, from the first stage on; seconds. */
export interface Ring {
  parts: readonly RingPart[];
  cycle: number;
  offset: number;
}

/** What of a ring is dragged: the end of a stage's green, the end of the cycle, or the offset. */
export type Grip = { is: "green"; stage: string } | { is: "cycle" } | { is: "offset" };

export const sameGrip = (a: Grip, b: Grip): boolean =>
  a.is === b.is && (a.is !== "green" || b.is !== "green" || a.stage === b.stage);

export function ringOf({ stages, cycle, offset }: DayPlan): Ring {
  const parts = stages.map(({ id, begin, end, split, on_call }) => ({
    stage: id,
    green: tidy(end - begin),
    between: tidy(split - (end - begin)),
    onCall: on_call,
  }));
  return { parts, cycle: tidy(cycle), offset: tidy(offset % Math.max(cycle, 1)) };
}

/** Seconds of what a grip holds. */
export function secondsOf(ring: Ring, grip: Grip): number {
  if (grip.is === "green") return ring.parts.find(({ stage }) => stage === grip.stage)?.green ?? 0;
  return grip.is === "cycle" ? ring.cycle : ring.offset;
}

/** Greens are shorter in no program: so far a grip can be dragged. What else forbids it, the server says. */
export const LEAST = 1;

/** The ring with a grip at other seconds, as it is shown until the server has answered. */
export function dragged(ring: Ring, grip: Grip, seconds: number, keepCycle: boolean): Ring {
  if (grip.is === "offset") return { ...ring, offset: wrap(seconds, ring.cycle) };
  if (grip.is === "cycle") return stretched(ring, seconds);
  const at = ring.parts.findIndex(({ stage }) => stage === grip.stage);
  if (at < 0) return ring;
  const more = seconds - nth(ring.parts, at).green;
  const other = keepCycle ? following(ring, at) : null;
  const parts = ring.parts.map((part, n) =>
    n === at
      ? { ...part, green: seconds }
      : n === other
        ? { ...part, green: Math.max(0, tidy(part.green - more)) }
        : part,
  );
  return { ...ring, parts, cycle: keepCycle ? ring.cycle : tidy(ring.cycle + more) };
}

/** The next stage that comes in every cycle: it gives or takes seconds. */
function following({ parts }: Ring, at: number): number | null {
  for (let k = 1; k < parts.length; k++) {
    const n = (at + k) % parts.length;
    if (!nth(parts, n).onCall) return n;
  }
  return null;
}

function stretched(ring: Ring, cycle: number): Ring {
  const between = ring.parts.reduce((sum, one) => sum + one.between, 0);
  const green = ring.cycle - between;
  const factor = green > 0 ? Math.max(0, cycle - between) / green : 1;
  return { ...ring, cycle, parts: ring.parts.map((one) => ({ ...one, green: one.green * factor })) };
}

/** Where a part begins in the bar. */
export function beginOf({ parts }: Ring, at: number): number {
  return parts.slice(0, at).reduce((sum, one) => sum + one.green + one.between, 0);
}

/** An offset is one of the seconds of the cycle. */
export function wrap(seconds: number, cycle: number): number {
  return cycle > 0 ? tidy(((seconds % cycle) + cycle) % cycle) : 0;
}

const tidy = (value: number): number => Math.round(value * 1e6) / 1e6;
