import type { Incident } from "../api/runs";
import type { Category } from "../api/types";
import type { Mark, MarkKind } from "../map/scene";
import { CATEGORY_WORD, count, hoursMinutes } from "../ui/words";

/** Simulated seconds for which something counts as having just happened. */
const FRESH = 4;
/** No more than this many, the newest, are drawn. */
const DRAWN = 300;

const KIND: Partial<Record<Incident["kind"], MarkKind>> = {
  collision: "collision",
  emergency_stop: "braking",
  teleport_start: "teleported",
  teleport_end: "teleported",
  jam_begin: "jam",
  jam_end: "jam",
  measure_begin: "measure",
  measure_end: "measure",
  rule_started: "rule",
  rule_acted: "rule",
  rule_ended: "rule",
  rule_failed: "rule",
  rule_overridden: "rule",
};

export const MARK_WORD: Record<MarkKind, string> = {
  collision: "Collision",
  braking: "Emergency braking",
  teleported: "Teleported",
  jam: "Jam",
  measure: "Measure",
  rule: "Rule",
  met: "Count met",
  unmet: "Count not met",
};

export const markKind = (incident: Incident): MarkKind => KIND[incident.kind] ?? "teleported";

/** An incident in a sentence, with whom. */
export function sentence(incident: Incident, categories: ReadonlyMap<string, Category>): string {
  const who = named(incident.actor, categories);
  switch (incident.kind) {
    case "collision":
      return incident.partner
        ? `${who} collided with ${named(incident.partner, categories)}`
        : `${who} collided`;
    case "emergency_stop":
      return `${who} braked in an emergency`;
    case "teleport_start":
      return `${who} was gridlocked and teleported`;
    case "teleport_end":
      return `${who} was put back on the road after its teleport`;
    case "jam_begin":
      return `A jam${queued(incident)} began at ${who}`;
    case "jam_end":
      return `A jam ended${lasted(incident)}`;
    case "lost":
      return `${who} did not come back with the saved state`;
    case "stranded":
      return `${who} was stranded: every route to its goal was closed`;
    case "measure_begin":
      return `Measure ${incident.actor} began`;
    case "measure_end":
      return `Measure ${incident.actor} ended`;
    case "rule_started":
      return `${who} began rule ${incident.rule}${values(incident)}`;
    case "rule_acted":
      return `${who}: ${incident.detail ?? ""} (rule ${incident.rule})`;
    case "rule_ended":
      return `${who} has done rule ${incident.rule}`;
    case "rule_failed":
      return `${who} could not do rule ${incident.rule ?? ""}: ${incident.detail ?? ""}`;
    case "rule_overridden":
      return `${who} stopped rule ${incident.rule}: ${incident.detail ?? ""}`;
    default:
      return [who, incident.kind.replaceAll("_", " ")].filter(Boolean).join(": ");
  }
}

const queued = ({ queue }: Incident): string => (queue ? ` of ${count(queue, "vehicle")}` : "");
const lasted = ({ waited }: Incident): string =>
  waited ? ` after ${waited < 60 ? `${Math.round(waited)} s` : hoursMinutes(waited)}` : "";

function values(incident: Incident): string {
  const known = Object.entries(incident.values ?? {});
  return known.length === 0
    ? ""
    : ` (${known.map(([name, value]) => `${name} ${value.toFixed(2)}`).join(", ")})`;
}

function named(id: string, categories: ReadonlyMap<string, Category>): string {
  const category = categories.get(id);
  return !category || id.toLowerCase().startsWith(category) ? id : `${CATEGORY_WORD[category]} ${id}`;
}

/** What is drawn at a time: all incidents up to then, the newest most visible. */
export function marksAt(incidents: readonly Incident[], time: number): Mark[] {
  return incidents
    .filter((one) => one.time <= time + 1e-6)
    .slice(-DRAWN)
    .flatMap((one) =>
      one.x === undefined || one.y === undefined || one.kind === "stranded"
        ? []
        : [
            {
              x: one.x,
              y: one.y,
              kind: markKind(one),
              fresh: time - one.time < FRESH,
            },
          ],
    );
}
