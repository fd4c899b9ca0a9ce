import { useEffect, useState } from "react";

/** Whether something has been so for longer than `wait` milliseconds: what is quicker needs no word. */
export function useSlow(busy: boolean, wait = 300): boolean {
  const [slow, setSlow] = useState(false);
  useEffect(() => {
    if (!busy) return;
    const timer = setTimeout(() => setSlow(true), wait);
    return () => {
      clearTimeout(timer);
      setSlow(false);
    };
  }, [busy, wait]);
  return slow;
}
