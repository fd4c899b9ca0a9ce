import { t } from "@lingui/core/macro";

import { exchange, type Format } from "../api/exchange";
import { localized } from "../language/localized";
import { served } from "../language/served";
import { sentence } from "../ui/words";

/** What formats are that the page has words of its own for. */
const WORDS = localized((): Record<string, string> => ({
  openscenario: t`Road users and rules for esmini, ScenarioRunner and others, with the map beside them. SUMO traffic is not exported.`,
  sumo: t`Network, routes and configuration, which run with plain sumo -c.`,
  graphml: t`The lane graph with the scenario on it, for networkx and other graph tools.`,
}));

/** What a format is, in a sentence. */
export const wordsOf = ({ id, description }: Format): string => WORDS()[id] ?? sentence(served(description));

/** Whether a scenario can be exported to it. */
export const takesScenarios = ({ writes, of }: Format): boolean => writes && of.includes("scenario");

/** Format that one of the files is read as, by the longest ending that one has. */
export async function formatOf(files: readonly File[]): Promise<string | null> {
  let best: { id: string; length: number } | null = null;
  for (const { id, reads, suffixes } of await exchange.formats())
    for (const end of reads ? suffixes : [])
      if (files.some(({ name }) => name.toLowerCase().endsWith(end)))
        if (best === null || end.length > best.length) best = { id, length: end.length };
  return best?.id ?? null;
}

export const VERSIONS = localized(() => [
  { value: "1.0", label: t`1.0, as ScenarioRunner reads it` },
  { value: "1.1", label: "1.1" },
  { value: "1.2", label: "1.2" },
  { value: "1.3", label: "1.3" },
]);
