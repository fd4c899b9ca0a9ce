import { plural, t } from "@lingui/core/macro";

import type { EditOf, ScenarioDocument } from "../api/types";
import { hoursMinutes } from "../ui/words";

type Transit = ScenarioDocument["transit"];
export type Stop = Transit["stops"][number];
export type Line = Transit["lines"][number];

/** A stop by its name, with its id where that is another. */
export const stopWord = ({ id, name }: Stop): string => (name && name !== id ? `${name} (${id})` : id);

/** The first of `stop-1`, `stop-2`, ... that neither a stop nor a line has. */
export function freePartId({ stops, lines }: Transit, stem: string): string {
  const taken = new Set([...stops, ...lines].map(({ id }) => id));
  for (let n = 1; ; n++) if (!taken.has(`${stem}-${n}`)) return `${stem}-${n}`;
}

/** How often a line runs. */
export const timetableWord = ({ headway, departures }: Line): string =>
  headway === null
    ? plural(departures.length, { one: "# departure", other: "# departures" })
    : t`every ${headway % 60 === 0 ? hoursMinutes(headway) : t`${headway} s`}`;

export const transitNote = ({ stops, lines }: Transit): string =>
  stops.length + lines.length === 0
    ? t({ message: "None", context: "public transport" })
    : [
        plural(lines.length, { one: "# line", other: "# lines" }),
        plural(stops.length, { one: "# stop", other: "# stops" }),
      ].join(", ");

type SetLine = EditOf<"set_line">;
type Dwell = NonNullable<SetLine["dwell"]>;

/** A dwell time as edits have it: a number is a constant, in seconds. */
export const dwellOf = (dwell: Line["dwell"]): Dwell =>
  typeof dwell === "number" ? { kind: "constant", value: dwell } : (dwell as Dwell);

/** Stops of a line as edits have them. */
export const servedOf = (stops: Line["stops"]): NonNullable<SetLine["stops"]> =>
  stops.map(({ stop, after, dwell }) => ({ stop, after, dwell: dwell === null ? null : dwellOf(dwell) }));
