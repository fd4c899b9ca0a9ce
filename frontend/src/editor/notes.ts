import { plural, t } from "@lingui/core/macro";

import { type Assets, CATEGORIES, type Category, type ScenarioDocument } from "../api/types";
import { countOf, weatherWord } from "../ui/words";

export function weatherNote(assets: Assets | null, preset: string): string {
  const found = assets?.weather.find((one) => one.name === preset);
  return found ? weatherWord(found) : preset;
}

export function actorNote({ actors, flows }: Pick<ScenarioDocument, "actors" | "flows">): string {
  if (actors.length + flows.length === 0) return t`Who is on the road?`;
  const numbers = new Map<Category, number>();
  for (const { category } of actors) numbers.set(category, (numbers.get(category) ?? 0) + 1);
  const parts = CATEGORIES.flatMap((category) => {
    const n = numbers.get(category);
    return n ? [countOf(category, n)] : [];
  });
  if (flows.length) parts.push(plural(flows.length, { one: "# flow", other: "# flows" }));
  return parts.join(", ");
}
