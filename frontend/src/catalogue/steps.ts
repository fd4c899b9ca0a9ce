/** What the server does with a map, in its words and in ours. */
const STEPS: [said: string, words: string][] = [
  ["reading the map", "reading the file"],
  ["building the lane graph", "finding all lanes and ways"],
  ["making the SUMO network", "preparing the simulation"],
  ["drawing the map", "drawing the map"],
];

/** A job's step for people: with the map's name if it tells one, and how many steps there are. */
export function stepWords(step: string): string {
  const [, name, said] = /^(?:([^:]+): )?(.*)$/.exec(step) ?? [];
  const at = STEPS.findIndex(([key]) => key === said);
  const words = at < 0 ? said.replaceAll("SUMO", "simulation") : `step ${at + 1} of ${STEPS.length}: ${STEPS[at][1]}`;
  return name ? `${name}, ${words}` : words.charAt(0).toUpperCase() + words.slice(1);
}
