import { useEffect } from "react";

import { useLoaded } from "../ui/useLoaded";

/** How often what is running is asked after, milliseconds. */
const POLL = 1000;

/** What `load` gives, asked for again and again while it is `running`. */
export function usePolled<T>(
  load: () => Promise<T>,
  running: (value: T) => boolean,
  every = POLL,
): { value: T | null; error: string | null; reload: () => void } {
  const { value, error, reload } = useLoaded(load);
  const live = value !== null && running(value);
  useEffect(() => {
    if (!live) return;
    const timer = setInterval(reload, every);
    return () => clearInterval(timer);
  }, [live, every, reload]);
  return { value, error, reload };
}

/** A list, asked for half as often while one of it is running. */
export const usePolledList = <T extends { state: string }>(load: () => Promise<T[]>) =>
  usePolled(load, (list) => list.some(({ state }) => state === "running"), 2 * POLL);
