import { plural, t } from "@lingui/core/macro";

import { lengthText, speedText } from "../language/units";
import { localized } from "../language/localized";
import type { ScenarioDocument } from "../api/types";
import { clock } from "../language/moments";
import type { PlaceNames } from "../map/placeNames";
import type { PickBy, Picked } from "./pick";

export type Measure = ScenarioDocument["measures"][number];

export const KIND = localized((): Record<Measure["kind"], string> => ({
  closure: t`Closure`,
  roadworks: t`Roadworks`,
  incident: t`Incident`,
  speed_limit: t`Speed limit`,
  permission: t`Permission`,
  signal_outage: t`Signal out of order`,
}));

export const SHOWS = localized(() => ({ off: t`Off`, flashing: t`Flashing` }));

/** Segments, lanes and turns that a measure names. */
export function placesOf(measure: Measure): readonly string[] {
  switch (measure.kind) {
    case "incident":
      return [measure.lane];
    case "signal_outage":
      return [];
    case "roadworks":
      return [...measure.places, ...measure.closed_lanes];
    default:
      return measure.places;
  }
}

function detail(measure: Measure, names: PlaceNames): string {
  const said = (places: readonly string[]): string => places.map((one) => names.place(one)).join("; ");
  const where = said(placesOf(measure));
  switch (measure.kind) {
    case "closure":
      return where;
    case "incident":
      return t`lane ${measure.lane} at s ${lengthText(measure.s)}`;
    case "speed_limit":
      return `${speedText(measure.speed)}: ${where}`;
    case "permission":
      return measure.allowed.length > 0
        ? t`only ${measure.allowed.join(", ")}: ${where}`
        : t`no ${measure.banned.join(", ")}: ${where}`;
    case "signal_outage":
      return `${names.junction(measure.junction)}: ${SHOWS()[measure.shows]}`;
    case "roadworks":
      return [
        said(measure.places),
        ...(measure.speed === null ? [] : [speedText(measure.speed)]),
        ...(measure.width === null ? [] : [t`lanes ${lengthText(measure.width, 2)} wide`]),
        ...(measure.closed_lanes.length > 0 ? [t`closed lanes ${measure.closed_lanes.join(", ")}`] : []),
      ].join(", ");
  }
}

/** Of the step, in a line. */
export const measureNote = (measures: readonly Measure[]): string =>
  measures.length === 0 ? t`None` : plural(measures.length, { one: "# measure", other: "# measures" });

/** A measure in words: what it is, where, and when. */
export const inWords = (
  measure: Measure,
  names: PlaceNames,
): { title: string; detail: string; when: string } => ({
  title: `${KIND()[measure.kind]} ${measure.id}`,
  detail: detail(measure, names),
  when: t`${clock(measure.begin)} to ${measure.end === null ? t`the end` : clock(measure.end)}`,
});

/** How places of a kind of measure can be picked, the usual one first. */
export function picksOf(kind: Measure["kind"]): readonly PickBy[] {
  switch (kind) {
    case "incident":
      return ["point"];
    case "signal_outage":
      return ["light"];
    case "roadworks":
    case "speed_limit":
      return ["segment", "lane"];
    default:
      return ["segment", "lane", "turn"];
  }
}

/** 30 km/h in m/s. */
const SLOW = 30 / 3.6;

/** A measure at a first place, for the whole run, with an id that is free. */
export function newMeasure(
  kind: Measure["kind"],
  { name, s }: Picked,
  measures: readonly { id: string }[],
): Measure {
  const always = { id: freeId(kind, measures), begin: 0, end: null };
  const places = [name];
  switch (kind) {
    case "incident":
      return { ...always, kind, lane: name, s: Math.round(s * 10) / 10, length: 5 };
    case "signal_outage":
      return { ...always, kind, junction: name, shows: "off" };
    case "roadworks":
      return { ...always, kind, places, speed: SLOW, closed_lanes: [], width: null };
    case "speed_limit":
      return { ...always, kind, places, speed: SLOW };
    case "permission":
      return { ...always, kind, places, allowed: ["bus", "bicycle"], banned: [] };
    case "closure":
      return { ...always, kind, places, destinations: "leave" };
  }
}

function freeId(kind: Measure["kind"], measures: readonly { id: string }[]): string {
  const taken = new Set(measures.map(({ id }) => id));
  const stem = kind.replace("_", "-");
  for (let n = 1; ; n++) if (!taken.has(`${stem}-${n}`)) return `${stem}-${n}`;
}

/** The measure with a place added, or taken out if it was there; null if it would have none. */
export function withPlace(measure: Measure, { name, s }: Picked): Measure | null {
  if (measure.kind === "incident") return { ...measure, lane: name, s: Math.round(s * 10) / 10 };
  if (measure.kind === "signal_outage") return { ...measure, junction: name };
  const places = measure.places.includes(name)
    ? measure.places.filter((one) => one !== name)
    : [...measure.places, name];
  return places.length > 0 ? { ...measure, places } : null;
}
