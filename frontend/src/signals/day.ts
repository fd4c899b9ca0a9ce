import type { Edit } from "../api/types";
import type { Timing } from "./editing";

export type Plan = Timing["plans"][number];

export const DAY = 86_400;

/** From a time of the day on a plan runs; seconds. */
export interface Switch {
  time: number;
  plan: string;
}

/** Seconds of a time as the document has it, `06:30` or `06:30:15`. */
export function secondsOf(clock: string): number {
  const [h = 0, m = 0, s = 0] = clock.split(":").map(Number);
  return h * 3600 + m * 60 + s;
}

/** A time as the document has it. */
export function clockOf(seconds: number): string {
  const two = (n: number): string => String(n).padStart(2, "0");
  const whole = Math.round(seconds);
  const text = `${two(Math.floor(whole / 3600))}:${two(Math.floor(whole / 60) % 60)}`;
  return whole % 60 === 0 ? text : `${text}:${two(whole % 60)}`;
}

/** When plans take over, in the order of the day. */
export const switchesOf = (plans: readonly Plan[]): Switch[] =>
  plans
    .flatMap(({ id, times }) => times.map((time) => ({ time: secondsOf(time), plan: id })))
    .sort((a, b) => a.time - b.time);

/** Which plan runs from when until when; the last one of the day also before the first. */
export function spansOf(switches: readonly Switch[]): { begin: number; end: number; plan: string }[] {
  const last = switches[switches.length - 1];
  const first = switches[0];
  if (!first || !last) return [];
  const spans = switches.map(({ time, plan }, n) => ({
    begin: time,
    end: switches[n + 1]?.time ?? DAY,
    plan,
  }));
  return first.time > 0 ? [{ begin: 0, end: first.time, plan: last.plan }, ...spans] : spans;
}

/** A plan begins at other times: one of them is left out, another is new. */
export function withTimes(
  junction: string,
  { id, times }: Plan,
  { without, also }: { without?: number; also?: number },
): Edit {
  const kept = times.map(secondsOf).filter((time) => time !== without);
  const all = [...new Set(also === undefined ? kept : [...kept, also])].sort((a, b) => a - b);
  return { kind: "set_plan", junction, plan: id, times: all.map(clockOf) };
}
