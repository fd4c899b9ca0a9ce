import { useCallback, useState } from "react";

import { type StudyInfo, type StudyResults, studies } from "../api/studies";
import { useLoaded } from "../ui/useLoaded";
import { usePolled } from "./usePolled";

const NONE = Promise.resolve(null);

/** A study as it is now, and one of its figures once some run has ended. */
export function useStudy(study: string): {
  info: StudyInfo | null;
  results: StudyResults | null;
  error: string | null;
  choose: (figure: string) => void;
  reload: () => void;
} {
  const load = useCallback(() => studies.info(study), [study]);
  const { value: info, error, reload } = usePolled(load, ({ state }) => state === "running");
  const [figure, choose] = useState<string | null>(null);
  const done = info?.completed ?? 0;
  const results = useLoaded(
    useCallback(() => (done > 0 ? studies.results(study, figure) : NONE), [study, figure, done]),
  );
  return { info, results: results.value, error: error ?? results.error, choose, reload };
}
