import { plural, t } from "@lingui/core/macro";

import { fixed } from "../language/numbers";
import { localized } from "../language/localized";
import { lengthText, speedText } from "../language/units";
import type { Incident } from "../api/runs";
import type { Category } from "../api/types";
import type { Mark, MarkKind } from "../map/scene";
import { CATEGORY_WORD, hoursMinutes } from "../ui/words";
import { served } from "../language/served";

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
  story_ended: "rule",
};

export const MARK_WORD = localized((): Record<MarkKind, string> => ({
  collision: t`Collision`,
  braking: t`Emergency braking`,
  teleported: t`Removed and re-inserted (SUMO “teleport”)`,
  jam: t`Jam`,
  measure: t`Measure`,
  rule: t`Rule`,
  met: t`Count met`,
  unmet: t`Count not met`,
}));

export const markKind = (incident: Incident): MarkKind => KIND[incident.kind] ?? "teleported";

/** An incident in a sentence, with whom. */
export function sentence(incident: Incident, categories: ReadonlyMap<string, Category>): string {
  const who = named(incident.actor, categories);
  const rule = incident.rule ?? "";
  const detail = served(incident.detail ?? "");
  switch (incident.kind) {
    case "collision":
      return incident.partner
        ? t`${who} collided with ${named(incident.partner, categories)}`
        : t`${who} collided`;
    case "emergency_stop":
      return t`${who} braked in an emergency`;
    case "teleport_start":
      return t`${who} was gridlocked and teleported`;
    case "teleport_end":
      return t`${who} was put back on the road after its teleport`;
    case "jam_begin":
      return t`A jam${queued(incident)} began at ${who}`;
    case "jam_end":
      return t`A jam ended${lasted(incident)}`;
    case "lost":
      return t`${who} did not come back with the saved state`;
    case "stranded":
      return t`${who} was stranded: every route to its goal was closed`;
    case "route_changed":
      return t`${who} took another route: it did not get to the lane that it needed`;
    case "measure_begin":
      return t`Measure ${incident.actor} began`;
    case "measure_end":
      return t`Measure ${incident.actor} ended`;
    case "rule_started":
      return t`${who} triggered rule ${rule}${values(incident)}`;
    case "rule_acted":
      return t`${who}: ${detail} (rule ${rule})`;
    case "rule_ended":
      return t`${who} completed rule ${rule}`;
    case "rule_failed":
      return t`${who} could not do rule ${rule}: ${detail}`;
    case "rule_overridden":
      return t`${who} stopped rule ${rule}: ${detail}`;
    case "story_ended":
      return t`The story has ended`;
    default:
      return [who, incident.kind.replaceAll("_", " ")].filter(Boolean).join(": ");
  }
}

const queued = ({ queue }: Incident): string =>
  queue ? t` of ${plural(queue, { one: "# vehicle", other: "# vehicles" })}` : "";
const lasted = ({ waited }: Incident): string =>
  waited ? t` after ${waited < 60 ? t`${Math.round(waited)} s` : hoursMinutes(waited)}` : "";

/** What a rule was about when it began, by the kind of condition; what is true or not says nothing more. */
const VALUE = localized((): Record<string, (value: number) => string> => ({
  ttc: (value) => t`time to collision ${fixed(value, 1)} s`,
  headway: (value) => t`time headway ${fixed(value, 1)} s`,
  stopped: (value) => t`stopped for ${fixed(value, 1)} s`,
  distance: (value) => t`distance ${lengthText(value, 1)}`,
  reaches: (value) => t`distance ${lengthText(value, 1)}`,
  travelled: (value) => t`travelled ${lengthText(value)}`,
  speed: (value) => t`speed ${speedText(value)}`,
  relative_speed: (value) => t`relative speed ${speedText(value)}`,
}));
/** Kinds of conditions of which the number is known without them. */
const PLAIN = new Set(["time", "signal", "appeared", "touched", "off_road"]);

function values(incident: Incident): string {
  const words = Object.entries(incident.values ?? {}).flatMap(([name, value]) => {
    // `all[1].ttc`: its place in the condition, and its kind.
    const kind = name.split(".").at(-1) ?? name;
    if (PLAIN.has(kind)) return [];
    return [VALUE()[kind]?.(value) ?? `${kind} ${fixed(value, 2)}`];
  });
  return words.length === 0 ? "" : ` (${words.join(", ")})`;
}

function named(id: string, categories: ReadonlyMap<string, Category>): string {
  const category = categories.get(id);
  return !category || id.toLowerCase().startsWith(category) ? id : `${CATEGORY_WORD()[category]} ${id}`;
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
