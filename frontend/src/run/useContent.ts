import { useEffect, useState } from "react";

import { type RunContent, runs } from "../api/runs";

/** What the scenario of a finished run says; null if it is not known (yet). */
export function useContent(run: string, over: boolean): RunContent | null {
  const [content, setContent] = useState<RunContent | null>(null);
  useEffect(() => {
    if (!over) return;
    let current = true;
    runs.content(run).then(
      (found) => {
        if (current) setContent(found);
      },
      () => undefined, // A run whose scenario is not kept has none that could be shown.
    );
    return () => {
      current = false;
    };
  }, [run, over]);
  return content;
}
