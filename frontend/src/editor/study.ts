import { plural, t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { FieldsOf, ScenarioDocument } from "../api/types";
import { hoursMinutes } from "../ui/words";

export type Study = ScenarioDocument["study"];
export type StudyFields = FieldsOf<"set_study", never>;
export type StationKind = "detectors" | "sections" | "cordons";

export const STATION = localized((): Record<StationKind, string> => ({
  detectors: t`Detector`,
  sections: t`Travel-time section`,
  cordons: t`Cordon`,
}));

/** A line across the road: nodes of the lane graph, one for each lane. */
export interface StationLine {
  field: string;
  word: string;
  nodes: readonly string[];
}

export interface Station {
  kind: StationKind;
  id: string;
  lines: readonly StationLine[];
}

/** The lines that each kind has, in the order in which they are chosen. */
const LINES = localized((): Record<StationKind, readonly (readonly [field: string, word: string])[]> => ({
  detectors: [["nodes", t`Lanes`]],
  sections: [
    ["begin", t`Begin`],
    ["end", "End"],
  ],
  cordons: [
    ["entries", t`Entries`],
    ["exits", t`Exits`],
  ],
}));

export const lineWords = (kind: StationKind): readonly string[] => LINES()[kind].map(([, word]) => word);

/** All stations, detectors first. */
export const stationsOf = ({ detectors, sections, cordons }: Study): Station[] => [
  ...detectors.map(({ id, nodes }) => station("detectors", id, [nodes])),
  ...sections.map(({ id, begin, end }) => station("sections", id, [begin, end])),
  ...cordons.map(({ id, entries, exits }) => station("cordons", id, [entries, exits])),
];

export const station = (kind: StationKind, id: string, nodes: readonly (readonly string[])[]): Station => ({
  kind,
  id,
  lines: LINES()[kind].map(([field, word], n) => ({ field, word, nodes: nodes[n] ?? [] })),
});

/** The fields of the study with these stations of one kind. */
export function stationFields(kind: StationKind, stations: readonly Station[]): StudyFields {
  const own = stations.filter((one) => one.kind === kind);
  const line = ({ lines }: Station, n: number): string[] => [...(lines[n]?.nodes ?? [])];
  if (kind === "detectors") return { detectors: own.map((one) => ({ id: one.id, nodes: line(one, 0) })) };
  if (kind === "sections")
    return { sections: own.map((one) => ({ id: one.id, begin: line(one, 0), end: line(one, 1) })) };
  return { cordons: own.map((one) => ({ id: one.id, entries: line(one, 0), exits: line(one, 1) })) };
}

/** The station with a node more in one of its lines, or without it. */
export const toggled = (one: Station, field: string, node: string): Station => ({
  ...one,
  lines: one.lines.map((line) =>
    line.field !== field
      ? line
      : {
          ...line,
          nodes: line.nodes.includes(node)
            ? line.nodes.filter((other) => other !== node)
            : [...line.nodes, node],
        },
  ),
});

/** The first of `detector-1`, `detector-2`, ... that no station has. */
export function freeStation(study: Study, kind: StationKind): string {
  const taken = new Set(stationsOf(study).map(({ id }) => id));
  const stem = kind.slice(0, -1);
  for (let n = 1; ; n++) if (!taken.has(`${stem}-${n}`)) return `${stem}-${n}`;
}

export const WHOLE_RUN = localized(() => t`The whole run`);

export function studyNote(study: Study): string {
  const stations = stationsOf(study).length;
  const words = [
    ...(study.warm_up > 0 ? [t`warm-up ${secondsWord(study.warm_up)}`] : []),
    ...(study.interval === null ? [] : [t`every ${secondsWord(study.interval)}`]),
    ...(stations > 0 ? [plural(stations, { one: "# station", other: "# stations" })] : []),
  ];
  return words.length > 0 ? words.join(", ") : WHOLE_RUN();
}

const secondsWord = (seconds: number): string =>
  seconds % 60 === 0 ? hoursMinutes(seconds) : t`${seconds} s`;
