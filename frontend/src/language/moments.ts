import { t } from "@lingui/core/macro";

import { fixed } from "./numbers";
import { preferences } from "./preferences";

/** The time of day at which the run that is shown begins, and how long it is, s; a clock of 0 is none. */
let start = { clock: 0, duration: Infinity };

/** Lets moments be times of day, in what is shown from now on; without a clock they count from the start. */
export function countFrom(clock: number, duration = Infinity): void {
  start = { clock, duration };
}

/** Whether moments are times of day. */
export const hasClock = (): boolean => start.clock > 0;

const DAY = 86_400;
const sixtieth = (n: number): string => String(Math.floor(n) % 60).padStart(2, "0");

/** The time of day of a moment: hours and minutes, seconds and so many digits of them. */
function timeOfDay(moment: number, digits: number | null): string {
  const steps = 10 ** (digits ?? 0);
  const s = (Math.round((start.clock + moment) * steps) / steps) % DAY;
  const [hour, minutes] = [Math.floor(s / 3600), sixtieth(s / 60)];
  const seconds =
    digits === null ? "" : `:${fixed(s % 60, digits).padStart(digits > 0 ? 3 + digits : 2, "0")}`;
  if (preferences().hours === 24) return `${String(hour).padStart(2, "0")}:${minutes}${seconds}`;
  return `${hour % 12 === 0 ? 12 : hour % 12}:${minutes}${seconds} ${hour < 12 ? "AM" : "PM"}`;
}

/** A moment of a run: its time of day, or minutes and seconds after the start. */
export function clock(moment: number): string {
  if (hasClock()) return timeOfDay(moment, Math.abs(moment - Math.round(moment)) < 0.05 ? 0 : 1);
  return minutesSeconds(moment);
}

function minutesSeconds(seconds: number): string {
  const s = Math.max(0, seconds);
  const minutes = Math.floor(s / 60);
  return `${minutes}:${fixed(s - 60 * minutes, 1).padStart(4, "0")}`;
}

/** A moment of a run of `longest` seconds; it is always as long. */
export function longClock(moment: number, longest: number): string {
  return hasClock() ? timeOfDay(moment, longest < 3600 ? 1 : 0) : lengthOfTime(moment, longest);
}

/** Hours, minutes and seconds of a long time; minutes, seconds and tenths of a short one. */
export function lengthOfTime(seconds: number, longest = seconds): string {
  if (longest < 3600) return minutesSeconds(seconds);
  const s = Math.max(0, seconds);
  return `${Math.floor(s / 3600)}:${sixtieth(s / 60)}:${sixtieth(s)}`;
}

/** A moment in as few words as it takes: `10:00`. */
export function shortClock(moment: number, longest: number): string {
  if (hasClock() && Math.round((start.clock + moment) * 10) % 600 === 0) return timeOfDay(moment, null);
  return (hasClock() || longest < 3600 ? clock(moment) : longClock(moment, longest)).replace(/[.,]0$/, "");
}

/** From when to when, of day or in the unit that fits: `09:45–10:00`, `0–15 min`, `0:15–10:00 h`. */
export function span(begin: number, end: number): string {
  if (hasClock()) return `${shortClock(begin, end)}–${shortClock(end, end)}`;
  if (begin % 60 !== 0 || end % 60 !== 0) {
    const at = (seconds: number): string => `${Math.floor(seconds / 60)}:${sixtieth(seconds)}`;
    return t`${at(begin)}–${at(end)} min`;
  }
  if (end <= 3600) return t`${begin / 60}–${end / 60} min`;
  const at = (seconds: number): string => `${Math.floor(seconds / 3600)}:${sixtieth(seconds / 60)}`;
  return t`${at(begin)}–${at(end)} h`;
}

const ROUND = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10_800, 21_600, 43_200, DAY];

/** Moments at round times of day, about `parts` of them. */
export function dayTicks(begin: number, seconds: number, parts: number): number[] {
  const step = ROUND.find((one) => one >= seconds / parts) ?? Math.ceil(seconds / parts / DAY) * DAY;
  const first = Math.ceil((start.clock + begin) / step - 1e-9);
  const last = Math.floor((start.clock + begin + seconds) / step + 1e-9);
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) => (first + k) * step - start.clock);
}

const UNITS = { s: 1, min: 60, h: 3600 } as const;
export type TimeUnit = keyof typeof UNITS;

/** A moment as a field shows it: a time of day, or a number of units. */
export function momentText(moment: number, unit: TimeUnit): string {
  if (hasClock()) return shortClock(moment, moment);
  return `${Number((moment / UNITS[unit]).toFixed(unit === "s" ? 1 : 2))} ${unit}`;
}

/**
 * Seconds after the start of what was typed: a time of day where there is a clock (`10:00`), else minutes
 * and seconds; or a number, with or without its unit. `null` is nothing; a sentence says what is wrong.
 */
export function readMoment(text: string, unit: TimeUnit): number | null | string {
  const typed = text.trim().toLowerCase().replace(",", ".");
  if (!typed) return null;
  const [, number, sign] = /^(\d+(?:\.\d+)?)\s*(s|min|h)?$/.exec(typed) ?? [];
  if (number !== undefined) return round(Number(number) * UNITS[(sign ?? unit) as TimeUnit]);
  const [, a, b, c, half] = /^(\d{1,3}):(\d\d)(?::(\d\d(?:\.\d+)?))?\s*(?:([ap])\.?m\.?)?$/.exec(typed) ?? [];
  if (a === undefined || b === undefined || Number(b) > 59 || Number(c ?? 0) >= 60) return unreadable(unit);
  const parts = [Number(a), Number(b), Number(c ?? 0)] as const;
  if (!hasClock()) {
    if (half !== undefined) return t`Set the time of day at the start first, in “Demand”`;
    // As they are shown: minutes and seconds, or hours as well.
    return c === undefined ? parts[0] * 60 + parts[1] : parts[0] * 3600 + parts[1] * 60 + parts[2];
  }
  const hour = half === undefined ? parts[0] : (parts[0] % 12) + (half === "p" ? 12 : 0);
  if (hour > 24 || (half !== undefined && parts[0] > 12)) return unreadable(unit);
  const moment = hour * 3600 + parts[1] * 60 + parts[2] - start.clock;
  // A run beyond midnight has the early hours of the next day.
  if (moment < 0 && moment + DAY <= start.duration) return round(moment + DAY);
  return moment < 0 ? t`Before the start at ${shortClock(0, 0)}` : round(moment);
}

const round = (seconds: number): number => Math.round(seconds * 1000) / 1000;

const unreadable = (unit: TimeUnit): string =>
  hasClock()
    ? t`A time such as ${shortClock(900, 900)}, or 15 min`
    : t`A number, such as ${momentText(900, unit)}`;
