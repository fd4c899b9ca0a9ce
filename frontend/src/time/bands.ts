import { t } from "@lingui/core/macro";

import { nth } from "../lists";
import { type Shown, shownOf } from "../signals/heads";

/** What a light showed: from `times[i]` on `states[i]`, a letter for each of its movements. */
export interface History {
  times: readonly number[];
  states: readonly string[];
}

/** Movements of a light that always show the same, and what they show when. */
export interface Band {
  /** How many movements. */
  movements: number;
  spans: { begin: number; end: number; shown: Shown }[];
}

/** The bands of a light up to a time, in the order of their first movements. */
export function bandsOf({ times, states }: History, end: number): Band[] {
  const longest = Math.max(0, ...states.map(({ length }) => length));
  const bands = new Map<string, Band>();
  for (let n = 0; n < longest; n++) {
    const shown = states.map((state) => shownOf(state[n] ?? ""));
    const key = shown.join();
    const known = bands.get(key);
    if (known) known.movements += 1;
    else bands.set(key, { movements: 1, spans: spansOf(times, shown, end) });
  }
  return [...bands.values()];
}

function spansOf(times: readonly number[], shown: readonly Shown[], end: number): Band["spans"] {
  const spans: Band["spans"] = [];
  shown.forEach((one, k) => {
    const begin = nth(times, k);
    const until = Math.min(times[k + 1] ?? end, end);
    if (until <= begin) return;
    const last = spans[spans.length - 1];
    if (last && last.shown === one && Math.abs(last.end - begin) < 1e-6) last.end = until;
    else spans.push({ begin, end: until, shown: one });
  });
  return spans;
}

/** How many movements show what at a time, in words; empty if that is not known. */
export function shownWords(bands: readonly Band[], time: number): string {
  const count = new Map<Shown, number>();
  for (const { movements, spans } of bands) {
    const now = spans.find(({ begin, end }) => begin <= time + 1e-6 && time < end + 1e-6);
    if (now) count.set(now.shown, (count.get(now.shown) ?? 0) + movements);
  }
  const words: [Shown, string][] = [
    ["green", t`green`],
    ["permissive", t`give way`],
    ["yellow", t`yellow`],
    ["red", t`red`],
    ["off", t`off`],
  ];
  return words
    .flatMap(([shown, word]) => (count.has(shown) ? [`${count.get(shown)} ${word}`] : []))
    .join(", ");
}
