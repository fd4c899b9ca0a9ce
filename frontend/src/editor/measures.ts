import type { ScenarioDocument } from "../api/types";
import { clock, kmh } from "../ui/words";

export type Measure = ScenarioDocument["measures"][number];

const KIND: Record<Measure["kind"], string> = {
  closure: "Closure",
  roadworks: "Roadworks",
  incident: "Incident",
  speed_limit: "Speed limit",
  permission: "Permission",
  signal_outage: "Signal out of order",
};

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

function detail(measure: Measure): string {
  const where = placesOf(measure).join(", ");
  switch (measure.kind) {
    case "closure":
      return where;
    case "incident":
      return `lane ${measure.lane} at s ${measure.s} m`;
    case "speed_limit":
      return `${kmh(measure.speed)}: ${where}`;
    case "permission":
      return measure.allowed.length > 0
        ? `only ${measure.allowed.join(", ")}: ${where}`
        : `no ${measure.banned.join(", ")}: ${where}`;
    case "signal_outage":
      return `junction ${measure.junction}, ${measure.shows}`;
    case "roadworks":
      return [
        measure.places.join(", "),
        ...(measure.speed === null ? [] : [kmh(measure.speed)]),
        ...(measure.width === null ? [] : [`lanes ${measure.width} m wide`]),
        ...(measure.closed_lanes.length > 0 ? [`closed lanes ${measure.closed_lanes.join(", ")}`] : []),
      ].join(", ");
  }
}

/** A measure in words: what it is, where, and when. */
export const inWords = (measure: Measure): { title: string; detail: string; when: string } => ({
  title: `${KIND[measure.kind]} ${measure.id}`,
  detail: detail(measure),
  when: `${clock(measure.begin)} to ${measure.end === null ? "the end" : clock(measure.end)}`,
});
