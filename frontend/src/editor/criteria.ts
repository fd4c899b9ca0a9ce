import { plural, t } from "@lingui/core/macro";

import { served } from "../language/served";
import { localized } from "../language/localized";
import type { ActorMeasureInfo, FigureInfo } from "../api/figures";
import type { Actor } from "../api/types";
import { sentence } from "../ui/words";

/** Operators of criteria, in the words of the reports. */
export const OPERATORS = localized((): [op: string, words: string][] => [
  [">=", t`at least`],
  ["<=", t`at most`],
  ["==", t`exactly`],
  [">", t`more than`],
  ["<", t`less than`],
]);
/** What is asked of a road user most, as the reports say it. */
const PLAIN = localized((): Record<string, string> => ({
  "arrived == 1": t`reaches its goal`,
  "arrived >= 1": t`reaches its goal`,
  "collided == 0": t`does not collide`,
  "stopped == 1": t`comes to a standstill`,
  "fired == 1": t`fires`,
  "fired == 0": t`does not fire`,
}));
/** Means every ego where no road user has this id. */
export const EGO = "ego";
/** The subject of criteria about all road users. */
export const WHOLE_RUN = "";

/** A criterion in parts: `name(actor) op bound unit`. */
export interface Criterion {
  name: string;
  /** Id of a road user, or "ego"; of two with a comma; of a rule; "" for the whole run. */
  actor: string;
  op: string;
  bound: number;
  unit: string;
}

type Measure = Pick<FigureInfo | ActorMeasureInfo, "name" | "label" | "unit">;

const FORM =
  /^\s*([A-Za-z_]\w*)\s*(?:\(\s*([^()\s]+)\s*\)\s*)?(>=|<=|==|>|<)\s*([-+.\deE]+)\s*(%|[A-Za-z][A-Za-z/\d]*)?\s*$/;

/** The parts of a criterion; null if it is not one. */
export function partsOf(text: string): Criterion | null {
  const found = FORM.exec(text);
  if (!found) return null;
  const [, name = "", actor = WHOLE_RUN, op = "", bound = "", unit = ""] = found;
  return { name, actor, op, bound: Number(bound), unit };
}

/** The text of a criterion, as files have it. */
export function textOf({ name, actor, op, bound, unit }: Criterion): string {
  const about = actor === WHOLE_RUN ? name : `${name}(${actor})`;
  return `${about} ${op} ${bound}${unit ? ` ${unit}` : ""}`;
}

/** A criterion as a sentence; as it is written where the measure is not known. */
export function criterionWords(
  text: string,
  measures: { run: readonly Measure[]; actors: readonly Measure[] },
): string {
  const parts = partsOf(text);
  if (!parts) return text;
  const known = parts.actor === WHOLE_RUN ? measures.run : measures.actors;
  const measure = known.find(({ name }) => name === parts.name);
  if (!measure) return text;
  const plain = PLAIN()[`${parts.name} ${parts.op} ${parts.bound}`];
  if (parts.actor !== WHOLE_RUN && plain) return `${parts.actor} ${plain}`;
  const [one = "", other] = parts.actor.split(",");
  const whose = other === undefined ? one : t`${one} to ${other}`;
  const about = parts.actor === WHOLE_RUN ? served(measure.label) : t`${served(measure.label)} of ${whose}`;
  const op = OPERATORS().find(([sign]) => sign === parts.op)?.[1] ?? parts.op;
  const unit = parts.unit || measure.unit;
  return `${sentence(about)}: ${op} ${parts.bound}${unit ? ` ${unit}` : ""}`;
}

/** So many suggestions are offered at once. */
const SUGGESTED = 5;

/** What is asked of most scenes, of those that are not asked yet: no collision, a gap before who walks. */
export function suggestedCriteria(
  actors: readonly Pick<Actor, "id" | "ego" | "category">[],
  criteria: readonly string[],
): string[] {
  const egos = actors.filter(({ ego }) => ego).map(({ id }) => id);
  if (egos.length === 0) return [];
  const taken = actors.some(({ id }) => id === EGO);
  const walkers = actors.filter(({ category, ego }) => category === "pedestrian" && !ego);
  return (taken ? egos : [EGO])
    .flatMap((one) => [
      `collided(${one}) == 0`,
      ...walkers.map(({ id }) => `stopped_before(${one},${id}) >= 0.5 m`),
    ])
    .filter((text) => !criteria.includes(text))
    .slice(0, SUGGESTED);
}

/** What the head of the step says. */
export const criteriaNote = (criteria: readonly string[]): string =>
  criteria.length === 0
    ? t`When has a run passed?`
    : plural(criteria.length, { one: "# criterion", other: "# criteria" });
