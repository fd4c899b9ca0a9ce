import { useEffect, useState } from "react";

import { api } from "../api/client";
import { reasonOf } from "../ui/reason";
import { Planned } from "./planned";

/** Milliseconds without a further edit before the plan is asked for. */
const QUIET = 250;

export interface Plan {
  /** The newest that is known; it may be of the version before. */
  planned: Planned | null;
  /** Whether a newer one is being made. */
  busy: boolean;
  error: string | null;
}

/** Where road users are planned to be, asked of the server anew with each version of the scenario. */
export function usePlanned(name: string, version: number, wanted: boolean): Plan {
  const [plan, setPlan] = useState<Plan & { of: number }>({
    planned: null,
    busy: false,
    error: null,
    of: -1,
  });
  useEffect(() => {
    if (!wanted || plan.of === version) return;
    let current = true;
    setPlan((old) => ({ ...old, busy: true }));
    const timer = setTimeout(() => {
      api.plan(name).then(
        (columns) => {
          if (current) setPlan({ planned: new Planned(columns), busy: false, error: null, of: version });
        },
        (reason: unknown) => {
          if (current) setPlan({ planned: null, busy: false, error: reasonOf(reason), of: version });
        },
      );
    }, QUIET);
    return () => {
      current = false;
      clearTimeout(timer);
    };
  }, [name, version, wanted, plan.of]);
  return plan;
}
