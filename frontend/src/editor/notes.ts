import { type Assets, CATEGORIES, type ScenarioDocument } from "../api/types";
import { CATEGORY_WORD, count, weatherWord } from "../ui/words";

export function weatherNote(assets: Assets | null, preset: string): string {
  const found = assets?.weather.find((one) => one.name === preset);
  return found ? weatherWord(found) : preset;
}

export function actorNote({ actors, flows }: Pick<ScenarioDocument, "actors" | "flows">): string {
  if (actors.length + flows.length === 0) return "Who is on the road?";
  const parts = CATEGORIES.flatMap((category) => {
    const n = actors.filter((actor) => actor.category === category).length;
    const word = CATEGORY_WORD[category].toLowerCase();
    return n ? [count(n, word, word === "bus" ? "buses" : `${word}s`)] : [];
  });
  if (flows.length) parts.push(count(flows.length, "flow"));
  return parts.join(", ");
}
