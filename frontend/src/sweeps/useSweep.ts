import { useCallback, useEffect } from "react";

import { type SweepCases, type SweepInfo, sweeps } from "../api/sweeps";
import { useLoaded } from "../ui/useLoaded";

/** How often a running sweep is asked after, milliseconds. */
export const POLL = 1000;

const NONE = Promise.resolve(null);

/** A sweep as it is now, and its cases unless it is running. */
export function useSweep(sweep: string): {
  info: SweepInfo | null;
  cases: SweepCases | null;
  error: string | null;
  reload: () => void;
} {
  const { value: info, error, reload } = useLoaded(useCallback(() => sweeps.info(sweep), [sweep]));
  const running = info?.state === "running";
  useEffect(() => {
    if (!running) return;
    const timer = setInterval(reload, POLL);
    return () => clearInterval(timer);
  }, [running, reload]);
  const known = info !== null && !running;
  const table = useLoaded(useCallback(() => (known ? sweeps.cases(sweep) : NONE), [sweep, known]));
  return { info, cases: known ? table.value : null, error: error ?? table.error, reload };
}
