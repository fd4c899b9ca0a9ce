import { useEffect, useState } from "react";

/**
 * What was chosen, shown until what it belongs to has come again or the choice was refused: `value` is
 * what is known, `from` changes when it is known anew.
 */
export function useAsked<T>(value: T, from: unknown): [T, (next: T, made: Promise<boolean>) => void] {
  const [asked, setAsked] = useState<{ next: T } | null>(null);
  useEffect(() => setAsked(null), [from]);
  const ask = (next: T, made: Promise<boolean>): void => {
    const mine = { next };
    setAsked(mine);
    void made.then((done) => {
      if (!done) setAsked((now) => (now === mine ? null : now));
    });
  };
  return [asked ? asked.next : value, ask];
}
