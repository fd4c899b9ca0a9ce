import { dayTicks, hasClock } from "../language/moments";
import { ticks } from "../run/scale";

/** The stretch of time that is in sight, and the pixels that it has. */
export interface Sight {
  /** Seconds after the start of the run. */
  begin: number;
  seconds: number;
  width: number;
}

/** Seconds; nothing shorter is in sight. */
export const SHORTEST = 2;

/** Pixels from the left of an instant. */
export const toX = ({ begin, seconds, width }: Sight, time: number): number =>
  ((time - begin) / seconds) * width;

/** The instant at so many pixels from the left. */
export const toTime = ({ begin, seconds, width }: Sight, x: number): number => begin + (x / width) * seconds;

const within = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));

/** Shows more or less around an instant, which stays where it is as far as the ends allow. */
export function zoomed(sight: Sight, factor: number, around: number, longest: number): Sight {
  const seconds = within(sight.seconds / factor, Math.min(SHORTEST, longest), longest);
  const share = (around - sight.begin) / sight.seconds;
  return { ...sight, seconds, begin: within(around - share * seconds, 0, longest - seconds) };
}

/** Moves what is in sight by so many seconds, not beyond the ends. */
export const panned = (sight: Sight, by: number, longest: number): Sight => ({
  ...sight,
  begin: within(sight.begin + by, 0, Math.max(0, longest - sight.seconds)),
});

const STEPS = [0.1, 0.5, 1, 5, 10, 30, 60, 300] as const;
/** Pixels of the smallest step of a drag. */
const STEP_PIXELS = 3;

/** Seconds to which a drag snaps: round, and at least some pixels. */
export function snapStep({ seconds, width }: Sight): number {
  const least = (STEP_PIXELS * seconds) / Math.max(width, 1);
  return STEPS.find((one) => one >= least) ?? 600;
}

/** The nearest multiple of a step, without the noise of binary fractions. */
export const snapped = (time: number, step: number): number =>
  Number((Math.round(time / step) * step).toFixed(3));

/** Pixels that the word of a tick needs. */
const TICK_PIXELS = 74;

/** Round instants in sight. */
export function ticksOf({ begin, seconds, width }: Sight): number[] {
  const parts = Math.max(1, Math.floor(width / TICK_PIXELS));
  // Of long times minutes are round, not hundreds of seconds.
  if (hasClock() || seconds > 120) return dayTicks(begin, seconds, parts);
  const round = ticks(seconds, parts);
  const step = (round[1] ?? seconds) - (round[0] ?? 0);
  const first = Math.ceil(begin / step - 1e-9);
  const last = Math.floor((begin + seconds) / step + 1e-9);
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) =>
    Number(((first + k) * step).toPrecision(12)),
  );
}
