import { useCallback } from "react";

import { type SweepCases, type SweepInfo, sweeps } from "../api/sweeps";
import { useLoaded } from "../ui/useLoaded";
import { usePolled } from "./usePolled";

const NONE = Promise.resolve(null);

/** A sweep as it is now, and its cases unless it is running. */
export function useSweep(sweep: string): {
  info: SweepInfo | null;
  cases: SweepCases | null;
  error: string | null;
  reload: () => void;
} {
  const load = useCallback(() => sweeps.info(sweep), [sweep]);
  const { value: info, error, reload } = usePolled(load, ({ state }) => state === "running");
  const known = info !== null && info.state !== "running";
  const table = useLoaded(useCallback(() => (known ? sweeps.cases(sweep) : NONE), [sweep, known]));
  return { info, cases: known ? table.value : null, error: error ?? table.error, reload };
}
