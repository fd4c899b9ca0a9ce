import type { ScenarioEntry } from "../api/types";

type Named = Pick<ScenarioEntry, "name" | "title">;

/** What a scenario is called: its title, else its name. */
export const titleOf = ({ name, title }: Named): string => title ?? name;

/** Titles that several have. */
export function repeatedTitles(list: readonly Named[]): ReadonlySet<string> {
  const titles = list.map(titleOf);
  return new Set(titles.filter((title, n) => titles.indexOf(title) !== n));
}

/** A label for each scenario, in the same order; whose title others have, too, has its name beside it. */
export function scenarioLabels(list: readonly Named[]): string[] {
  const repeated = repeatedTitles(list);
  return list.map((one) => {
    const title = titleOf(one);
    return repeated.has(title) && title !== one.name ? `${title} (${one.name})` : title;
  });
}
