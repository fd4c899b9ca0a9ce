import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import { sentence } from "../ui/words";
import { served } from "../language/served";

/** What the server does with a map, in its words and in ours. */
const STEPS = localized((): [said: string, words: string][] => [
  ["reading the map", t`reading the file`],
  ["building the lane graph", t`finding all lanes and connections`],
  ["making the SUMO network", t`preparing the simulation`],
  ["comparing the SUMO network with the map", t`comparing the simulation with the map`],
]);

/** A job's step in words: with the map's name if there is one, and how many steps there are. */
export function stepWords(step: string): string {
  const [, name, said = step] = /^(?:([^:]+): )?(.*)$/.exec(step) ?? [];
  const known = STEPS().find(([key]) => key === said);
  const words = known
    ? t`step ${STEPS().indexOf(known) + 1} of ${STEPS().length}: ${known[1]}`
    : served(said ?? "").replaceAll("SUMO", "simulation");
  return name ? `${name}, ${words}` : sentence(words);
}
