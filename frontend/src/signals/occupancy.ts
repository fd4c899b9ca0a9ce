import { t } from "@lingui/core/macro";

import type { Detector } from "../api/signals";

/** What is known of detectors at a moment of a run. */
export interface Sight {
  /** Ids of those with a road user on them. */
  on: ReadonlySet<string>;
  /** What is said of detectors with one name and purpose. */
  words: (loops: readonly Detector[]) => string;
}

/** Detectors in a run that is watched. */
export function seenLive(occupied: ReadonlySet<string>): Sight {
  return {
    on: occupied,
    words: (loops) => (loops.some(({ id }) => occupied.has(id)) ? t`occupied` : t`free`),
  };
}

/** Detectors in a recorded run; null without a log of calls. */
export function seenInLog(detectors: readonly Detector[], time: number): Sight | null {
  if (!detectors.some(({ calls }) => calls.length > 0)) return null;
  const on = detectors.filter(({ calls }) => calls.some(([begin, end]) => begin <= time && time < end));
  return {
    on: new Set(on.map(({ id }) => id)),
    words: (loops) => (loops.some(({ bus }) => bus) ? t`not logged` : occupancy(loops, time)),
  };
}

/** Whether a road user is on a detector, and for what share of the last minute. */
export function occupancy(loops: readonly Detector[], time: number): string {
  const from = Math.max(0, time - 60);
  const seen = loops.flatMap(({ calls }) => calls);
  const on = seen.some(([begin, end]) => begin <= time && time < end);
  const busy = seen.reduce(
    (sum, [begin, end]) => sum + Math.max(0, Math.min(end, time) - Math.max(begin, from)),
    0,
  );
  const share = time > from ? (100 * busy) / ((time - from) * loops.length) : 0;
  return t`${on ? t`occupied` : t`free`}, ${Math.round(share)} % of the last minute`;
}
