import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { Problem } from "../api/types";
import type { Graph } from "../map/graph";
import { placeWord } from "./placeWords";
import { served } from "../language/served";

/** From so many of one kind on they are one line, which opens. */
const MANY = 4;

/** Problems of one kind; with a title if they are too many to be listed one by one. */
export interface ProblemGroup {
  key: string;
  title: string | null;
  problems: readonly Problem[];
}

/** What must be solved first, then what is odd; many of one kind together. */
export function grouped(problems: readonly Problem[], graph: Graph): ProblemGroup[] {
  const groups = new Map<string, Problem[]>();
  for (const problem of problems) {
    const key = `${problem.severity} ${problem.code}`;
    const known = groups.get(key);
    if (known) known.push(problem);
    else groups.set(key, [problem]);
  }
  return [...groups]
    .map(([key, all]) => ({ key, title: all.length < MANY ? null : titleOf(all, graph), problems: all }))
    .sort((a, b) => Number(b.key.startsWith("error")) - Number(a.key.startsWith("error")));
}

function titleOf(problems: readonly Problem[], graph: Graph): string {
  const [first] = problems;
  if (!first) return "";
  const number = problems.length.toLocaleString(i18n.locale);
  const title = TITLE()[first.code];
  return title ? t`${number} times: ${title}` : t`${number} of a kind, the first: ${inWords(first, graph)}`;
}

/** Kinds of problems that many road users can have at once; of others the first is quoted. */
const TITLE = localized((): Record<string, string> => ({
  bodies_overlap: t`two road users overlap where they start`,
  node_taken: t`two road users start at the same point`,
  spawn_outside_roi: t`a start lies outside the region`,
  goal_outside_roi: t`a goal lies outside the region`,
  goal_unreachable: t`a goal cannot be reached inside the region`,
  goal_not_candidate: t`a goal is not where a path through the region ends`,
  no_goal: t`no path leads on from a start`,
  tight_curve: t`a long vehicle starts in a tight curve`,
  body_over_border: t`a vehicle reaches over the border of its lane`,
  off_lane: t`a road user is outside its lane`,
  speed_implausible: t`a desired speed is implausible`,
}));

/** The message with its nodes as places: `Road 4, right lane 1, 12 m` in place of an id. */
export const inWords = ({ message, nodes }: Problem, graph: Graph): string =>
  nodes.reduce((text, id) => text.replaceAll(`'${id}'`, placeWord(graph, id)), served(message));
