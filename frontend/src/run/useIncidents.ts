import { useCallback, useEffect, useState } from "react";

import { type Incident, runs } from "../api/runs";

/** Incidents so far: reported live during a run, read from its results afterwards. */
export function useIncidents(
  run: string,
  over: boolean,
): { incidents: readonly Incident[]; add: (more: Incident[]) => void } {
  const [incidents, setIncidents] = useState<readonly Incident[]>([]);
  useEffect(() => {
    if (!over) return;
    let current = true;
    // A run that failed has none; what was reported live stays.
    runs.events(run).then(
      ({ events }) => {
        if (current) setIncidents(events);
      },
      () => undefined,
    );
    return () => {
      current = false;
    };
  }, [run, over]);
  const add = useCallback((more: Incident[]) => setIncidents((old) => [...old, ...more]), []);
  return { incidents, add };
}
