import { useCallback, useMemo, useState } from "react";

import type { Chosen } from "../api/models";
import type { RunWish } from "../api/runs";

/** Longer runs are made in slices, and not watched in real time. */
const LONG = 3600;

interface Chosens {
  inCarla: boolean;
  /** Seconds between recorded moments, or `step` or `none`. */
  recording: string;
  /** `real` or `fast`; null is what is usual. */
  pace: string | null;
  driver: Chosen | null;
  simulator: Chosen | null;
}

/** How a run is to be made: what is chosen in the step of the run, and started from anywhere. */
export interface RunChoices extends Chosens {
  pace: string;
  long: boolean;
  /** In SUMO, which can be forecast. */
  wish: RunWish;
  /** What to start. */
  started: RunWish;
  choose: (next: Partial<Chosens>) => void;
}

export function useRunChoices(scenario: string, duration: number): RunChoices {
  const [chosen, setChosen] = useState<Chosens>({
    inCarla: false,
    recording: "step",
    pace: null,
    driver: null,
    simulator: null,
  });
  const choose = useCallback((next: Partial<Chosens>) => setChosen((old) => ({ ...old, ...next })), []);
  return useMemo(() => {
    const { inCarla, recording, driver, simulator } = chosen;
    const long = duration > LONG;
    const pace = chosen.pace ?? (long ? "fast" : "real");
    const every = recording === "step" || recording === "none" ? null : Number(recording);
    const wish: RunWish = {
      scenario,
      speed: pace === "fast" ? null : 1,
      carla: inCarla,
      trajectories: inCarla || recording !== "none",
      every: inCarla ? null : every,
      ...(driver && { behaviour: driver }),
    };
    const started = simulator ? { scenario, trajectories: recording !== "none", every, simulator } : wish;
    return { ...chosen, pace, long, wish, started, choose };
  }, [scenario, duration, chosen, choose]);
}
