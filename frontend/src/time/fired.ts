import type { Incident } from "../api/runs";
import type { MarkKind } from "../map/scene";
import { markKind } from "../run/incidents";

/** A sign of each kind of mark, so that colour alone says nothing. */
export const GLYPH: Record<MarkKind, string> = {
  collision: "×",
  braking: "!",
  teleported: "↑",
  jam: "≡",
  measure: "−",
  rule: "▸",
  met: "✓",
  unmet: "≠",
};

/** What a rule of one actor did from when to when; without an end it was still at it. */
export interface Firing {
  rule: string;
  begin: number;
  end: number | null;
}

export const isRule = (one: Incident): boolean => markKind(one) === "rule";

/** When rules fired, in the order of their begin. */
export function firingsOf(incidents: readonly Incident[]): Firing[] {
  const fired: Firing[] = [];
  const open = new Map<string, Firing>();
  for (const { kind, rule, actor, time } of incidents) {
    if (!rule) continue;
    const key = `${rule} ${actor}`;
    if (kind === "rule_started") {
      const firing: Firing = { rule, begin: time, end: null };
      fired.push(firing);
      open.set(key, firing);
    } else if (kind === "rule_ended" || kind === "rule_failed" || kind === "rule_overridden") {
      const firing = open.get(key);
      if (firing) firing.end = time;
      open.delete(key);
    }
  }
  return fired;
}

/** Marks that would lie over each other are one: of those within so many seconds the first of each kind. */
export function thinnedMarks(incidents: readonly Incident[], apart: number): Incident[] {
  const last = new Map<MarkKind, number>();
  return incidents.filter((one) => {
    const kind = markKind(one);
    const before = last.get(kind);
    if (before !== undefined && one.time - before < apart) return false;
    last.set(kind, one.time);
    return true;
  });
}

/** Seconds by which two instants must differ to be two. */
const SAME = 0.05;

/** The next incident after a time, or the last one before. */
export function neighbour(incidents: readonly Incident[], time: number, step: 1 | -1): Incident | null {
  if (step === 1) return incidents.find((one) => one.time > time + SAME) ?? null;
  return incidents.findLast((one) => one.time < time - SAME) ?? null;
}

/** The incident nearest to a time, within so many seconds. */
export function nearestIncident(
  incidents: readonly Incident[],
  time: number,
  reach: number,
): Incident | null {
  let [best, least]: [Incident | null, number] = [null, reach];
  for (const one of incidents) {
    const away = Math.abs(one.time - time);
    if (away <= least) [best, least] = [one, away];
  }
  return best;
}
