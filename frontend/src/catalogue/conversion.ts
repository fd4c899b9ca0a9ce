import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { ConversionReport, ElementOutcome } from "../api/types";
import { sentence } from "../ui/words";
import { served } from "../language/served";

/** Entries with the same reason for several elements. */
export interface Finding {
  text: string;
  places: string[];
}

export interface Group {
  outcome: ElementOutcome;
  title: string;
  findings: Finding[];
}

const TITLES = localized((): [outcome: ElementOutcome, title: string][] => [
  ["lost", t`Could not be used`],
  ["repaired", t`Repaired`],
  ["guessed", t`Adapted or completed`],
  ["kept", t`Imported unchanged`],
]);

/** The commonest findings in plain sentences. */
const PLAIN = localized((): [RegExp, string][] => [
  [
    /of a connecting road have no SUMO lane: /,
    t`Short pieces of lanes inside junctions are left out, as no connection needs them`,
  ],
  [/have no SUMO lane: nothing leads there/, t`Short pieces of lanes are left out, as no lane leads there`],
  [
    /lanes of type (\w+) are open to no(?:body| road user) and left out/,
    t`Lanes of the kind “$1” are not driven on and are left out`,
  ],
  [
    /every crossing of a junction with lights has a light/,
    t`Every crosswalk of a junction with traffic lights got a light for pedestrians`,
  ],
  [/of [\d.]+ m have no SUMO lane$/, t`Lanes or parts of lanes that are missing in the simulation`],
  [/^SUMO's lane lies up to/, t`Lanes that lie a little beside their place in the simulation`],
  [/^no connection to lane/, t`Connections between lanes that are missing in the simulation`],
  [/^SUMO connects it to lane/, t`Connections between lanes that only the simulation has`],
  [/^crosswalk: crossings of the network/, t`Crosswalks that lie elsewhere in the simulation`],
  [/netconvert does not read it/, t`Signs of right of way, which netconvert does not read`],
  [
    /traffic lights have the network's programs/,
    t`The map does not say when its lights turn green: the programs of the network are used`,
  ],
  [
    /its width varies from|m wide here, and the SUMO lane/,
    t`Lanes whose width changes have one width in the simulation`,
  ],
  [
    /traffic lights? have programs of odscen's own/,
    t`The map does not say when its lights turn green: they got a timing of their own, in which no two conflicting connections have green at the same time`,
  ],
  [/^crosswalk, as a crossing/, t`Crosswalks, with place and width`],
  [/^yield, as right of way/, t`Signs to give way`],
  [/^traffic light, as right of way/, t`Traffic lights`],
  [/^stop, as right of way/, t`Stop signs`],
]);

/** One sentence without the numbers of a single place. */
export function plainFinding(reason: string): string {
  for (const [pattern, text] of PLAIN()) {
    const match = pattern.exec(reason);
    if (match) return text.replace("$1", match[1] ?? "");
  }
  const said = served(reason);
  return sentence(said === reason ? reason.replace(/\bSUMO('s)?( network)?/g, "the simulation$1") : said);
}

/** An element; of a map of another format with its id there, and how sure its importer is. */
function placeWords({ element, source_id, confidence }: ConversionReport["entries"][number]): string {
  const place = source_id ? `${element}, ${source_id}` : element;
  return confidence == null ? place : t`${place}, ${Math.round(100 * confidence)} % sure`;
}

/** What became of a map, what matters most first; elements of which the same is said are together. */
export function grouped(report: ConversionReport): Group[] {
  return TITLES().flatMap(([outcome, title]) => {
    const found = new Map<string, string[]>();
    for (const entry of report.entries) {
      if (entry.fate !== outcome) continue;
      const text = plainFinding(entry.reason);
      found.set(text, [...(found.get(text) ?? []), placeWords(entry)]);
    }
    const findings = [...found].map(([text, places]) => ({ text, places }));
    findings.sort((a, b) => b.places.length - a.places.length);
    return findings.length > 0 ? [{ outcome, title, findings }] : [];
  });
}

/** How much of the lanes can be driven and walked, in whole percent; null where there are none. */
export function coverage({ figures }: ConversionReport): { driving: number | null; walking: number | null } {
  const share = (kind: string): number | null => {
    const all = (figures[`${kind}_road_length`] ?? 0) + (figures[`${kind}_junction_length`] ?? 0);
    const used = (figures[`${kind}_road_covered`] ?? 0) + (figures[`${kind}_junction_covered`] ?? 0);
    return all > 0 ? Math.floor((100 * used) / all + 1e-6) : null;
  };
  return { driving: share("driving"), walking: share("walking") };
}
