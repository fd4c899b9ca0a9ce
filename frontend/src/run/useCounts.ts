import { useEffect, useState } from "react";

import { runs } from "../api/runs";

/** How many counts of vehicles the scenario of a finished run has. */
export function useCounts(run: string, over: boolean): number {
  const [counts, setCounts] = useState(0);
  useEffect(() => {
    if (!over) return;
    let current = true;
    // A run whose scenario is not kept has none that could be shown.
    runs.content(run).then(
      (found) => {
        if (current) setCounts(found.counts);
      },
      () => undefined,
    );
    return () => {
      current = false;
    };
  }, [run, over]);
  return counts;
}
