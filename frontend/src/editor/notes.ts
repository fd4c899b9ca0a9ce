import { type Assets, CATEGORIES, type ScenarioDocument } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { CATEGORY_WORD, count, weatherWord } from "../ui/words";
import { laneWord } from "./placeWords";
import { type Tool, toolWord } from "./placing";
import type { Step } from "./scene";

/** What to do next on the map, or what lies under the pointer. */
export function hintFor(step: Step, segments: number, tool: Tool | null, hover: Place | null, graph: Graph): string | null {
  if (step === "region" && segments === 0) return "Click a road or junction to begin the region";
  if (step !== "actors" || !tool) return null;
  if (hover) {
    const degrees = Math.round((((90 - (hover.hdg * 180) / Math.PI) % 360) + 360) % 360);
    return `${laneWord(graph, hover.id)}${hover.walk ? "" : `, heading ${degrees}°`}`;
  }
  if (tool.does === "copy" || tool.does === "move") return `Point at the place to ${tool.does} to`;
  const people = tool.does === "stream" ? tool.walk : tool.category === "pedestrian";
  return `Point at the ${people ? "edge of a road" : "lane"} where the ${toolWord(tool, CATEGORY_WORD)} starts`;
}

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
  if (flows.length) parts.push(count(flows.length, "stream"));
  return parts.join(", ");
}
