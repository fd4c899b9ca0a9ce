import { plural } from "@lingui/core/macro";
import type { MapInfo } from "../api/types";

type Losses = MapInfo["lost"];
type LossKind = keyof Losses & string;

const WORDS: Record<string, (count: number) => string> = {
  access_rules: (count) => plural(count, { one: "# access rule", other: "# access rules" }),
  connections: (count) => plural(count, { one: "# connection", other: "# connections" }),
  crosswalks: (count) => plural(count, { one: "# crosswalk", other: "# crosswalks" }),
  lanes_both_ways: (count) =>
    plural(count, { one: "# lane open both ways", other: "# lanes open both ways" }),
  road_lengths: (count) => plural(count, { one: "length of # road", other: "lengths of # roads" }),
  roads: (count) => plural(count, { one: "# road", other: "# roads" }),
  signals: (count) => plural(count, { one: "# light or sign", other: "# lights and signs" }),
  temporary_lanes: (count) =>
    plural(count, { one: "# road with temporary lanes", other: "# roads with temporary lanes" }),
  unknown_signs: (count) => plural(count, { one: "# sign not understood", other: "# signs not understood" }),
};

/** What of a map was lost for traffic, or guessed, in words: one for each kind. */
export function lossWords(losses: Losses): string[] {
  return Object.entries(losses).flatMap(([kind, count]) => {
    const words = WORDS[kind as LossKind];
    return words && count ? [words(count)] : [];
  });
}
