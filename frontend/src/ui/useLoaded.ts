import { useCallback, useEffect, useState } from "react";

import { reasonOf } from "./reason";

export interface Loaded<T> {
  value: T | null;
  error: string | null;
  reload: () => void;
}

/** Loads something and says when it failed; `load` must be stable. */
export function useLoaded<T>(load: () => Promise<T>): Loaded<T> {
  const [value, setValue] = useState<T | null>(null);
  const [error, setError] = useState<string | null>(null);
  const [turn, setTurn] = useState(0);
  useEffect(() => {
    let current = true;
    load().then(
      (found) => {
        if (current) {
          setValue(found);
          setError(null);
        }
      },
      (reason: unknown) => {
        if (current) setError(reasonOf(reason));
      },
    );
    return () => {
      current = false;
    };
  }, [load, turn]);
  return { value, error, reload: useCallback(() => setTurn((n) => n + 1), []) };
}
