import type { DayPlan, ShownStates } from "../api/signals";
import { nth } from "../lists";

/** What a light shows now; `since` and `before` are null if it did so when one began to look. */
export interface SignalNow {
  time: number;
  state: string;
  since: number | null;
  before: string | null;
  /** Id of the plan that runs, if that is known. */
  plan: string | null;
}

/** Where in the cycle of a plan a light is. */
export interface Cursor {
  second: number;
  /** Row of the stage whose green is shown; null between stages. */
  stage: number | null;
  /** Seconds for which the state has been shown; null if one began to look in the midst of it. */
  elapsed: number | null;
}

interface Span {
  begin: number;
  seconds: number;
  state: string;
}

/** Finds the state in the cycle; null if the plan does not show it, as between two plans. */
export function cursorAt(plan: DayPlan, now: SignalNow): Cursor | null {
  const spans = spansOf(plan);
  const same = spans.map((span, n) => ({ span, n })).filter(({ span }) => span.state === now.state);
  // The same state may come again: all red after each stage.
  const previous = (n: number): string => nth(spans, (n + spans.length - 1) % spans.length).state;
  const found = same.find(({ n }) => previous(n) === now.before) ?? same[0];
  if (!found) return null;
  const { begin, seconds } = found.span;
  const elapsed = now.since === null ? null : Math.max(0, now.time - now.since);
  // A green that is prolonged waits at its end.
  const second = begin + Math.min(elapsed ?? 0, seconds);
  const row = plan.stages.findIndex((stage) => begin >= stage.begin && begin < stage.end);
  return { second, stage: row < 0 ? null : row, elapsed };
}

function spansOf(plan: DayPlan): Span[] {
  const spans: Span[] = [];
  let now = 0;
  for (const { seconds, state } of plan.phases) {
    const last = spans[spans.length - 1];
    if (last?.state === state) last.seconds += seconds;
    else spans.push({ begin: now, seconds, state });
    now += seconds;
  }
  return spans;
}

/** What one light showed in a recorded run. */
export class ShownSignal {
  /** All that it showed, in order: from `times[i]` on `states[i]`. */
  readonly history: {
    times: readonly number[];
    states: readonly string[];
    plans: readonly string[];
  };

  constructor(private readonly columns: ShownStates) {
    const { times, shown, states, plans } = columns;
    this.history = { times, states: shown.map((row) => nth(states, row)), plans };
  }

  get light(): string {
    return this.columns.light;
  }

  /** What is shown at a time; null before the first state. */
  at(time: number): SignalNow | null {
    const { times, shown, states, plans } = this.columns;
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (nth(times, middle) <= time + 1e-6) low = middle + 1;
      else high = middle;
    }
    const i = low - 1;
    if (i < 0) return null;
    const state = nth(states, nth(shown, i));
    // A plan that takes over in the midst of a state continues it.
    let first = i;
    while (first > 0 && shown[first - 1] === shown[i]) first--;
    return {
      time,
      state,
      since: first > 0 ? nth(times, first) : null,
      before: first > 0 ? nth(states, nth(shown, first - 1)) : null,
      plan: plans[i] ?? null,
    };
  }
}

/** The state before and after a change that is seen live. */
export function changed(old: SignalNow | undefined, state: string, time: number): SignalNow {
  return {
    time,
    state,
    since: old ? time : null,
    before: old?.state ?? null,
    plan: null,
  };
}
