import { sentence } from "../ui/words";

/** What the server does with a map, in its words and in ours. */
const STEPS: [said: string, words: string][] = [
  ["reading the map", "reading the file"],
  ["building the lane graph", "finding all lanes and connections"],
  ["making the SUMO network", "preparing the simulation"],
  ["drawing the map", "drawing the map"],
];

/** A job's step in words: with the map's name if there is one, and how many steps there are. */
export function stepWords(step: string): string {
  const [, name, said = step] = /^(?:([^:]+): )?(.*)$/.exec(step) ?? [];
  const known = STEPS.find(([key]) => key === said);
  const words = known
    ? `step ${STEPS.indexOf(known) + 1} of ${STEPS.length}: ${known[1]}`
    : said.replaceAll("SUMO", "simulation");
  return name ? `${name}, ${words}` : sentence(words);
}
