import type { LightProgram } from "../api/signals";
import { nth } from "../lists";

/** For how long a plan of the day runs at a light; seconds of the run. */
export interface PlanSpan {
  plan: string;
  begin: number;
  end: number;
}

/** The plans that a light had, as its log says: `plans[i]` from `times[i]` on. */
export function loggedPlans(times: readonly number[], plans: readonly string[], end: number): PlanSpan[] {
  const spans: PlanSpan[] = [];
  plans.forEach((plan, n) => {
    const begin = nth(times, n);
    const until = Math.min(times[n + 1] ?? end, end);
    const last = spans[spans.length - 1];
    if (last?.plan === plan) last.end = Math.max(last.end, until);
    else if (until > begin) spans.push({ plan, begin, end: until });
  });
  return spans;
}

/** The plans that a light is to have: each takes over in its first stage from then on. */
export function plannedPlans({ plans }: LightProgram, end: number): PlanSpan[] {
  const begins = plans
    .flatMap(({ id, begins: at }) => at.map((begin) => ({ plan: id, begin })))
    .sort((a, b) => a.begin - b.begin);
  return begins
    .map(({ plan, begin }, n) => ({ plan, begin, end: Math.min(begins[n + 1]?.begin ?? end, end) }))
    .filter(({ begin, end: until }) => until > begin);
}

/** The plan that runs at a time; nothing where that is not known. */
export const planAt = (spans: readonly PlanSpan[], time: number): string | null =>
  spans.findLast(({ begin }) => begin <= time + 1e-6)?.plan ?? null;
