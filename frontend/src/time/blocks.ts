import { t } from "@lingui/core/macro";

import type { Actor, Edit, Flow, ScenarioDocument } from "../api/types";
import { KIND, type Measure } from "../editor/measures";
import { type Condition, draftOf, isGroup, type Rule, ruleOf } from "../editor/rules/draft";
import { clock } from "../language/moments";
import { CATEGORY_WORD, flowWord } from "../ui/words";

/** When something of a scenario is: seconds after the start of the run. */
export interface Times {
  begin: number;
  /** Null where it lasts until the run ends, or is an instant. */
  end: number | null;
}

export type BlockKind = "rule" | "measure" | "flow" | "actor";

/** Something of a scenario that has a time, as the time bar shows it. */
export interface Block extends Times {
  kind: BlockKind;
  id: string;
  /** What it is, for people. */
  word: string;
  /** Whether its end can be changed on its own. */
  ends: boolean;
  /** To where it is drawn; of an actor when it is planned to arrive. */
  until: number;
  category: Actor["category"] | null;
}

/** Which part of a block is held. */
export type Grip = "all" | "begin" | "end";

export const keyOf = ({ kind, id }: Pick<Block, "kind" | "id">): string => `${kind} ${id}`;

/** Seconds that are left between begin and end. */
const LEAST = 0.1;

/** Everything of a scenario that has a time: rules, measures and flows first, then road users. */
export function blocksOf(document: ScenarioDocument, durations: ReadonlyMap<string, number>): Block[] {
  const { duration } = document.simulation;
  return [
    ...document.rules.flatMap((rule) => ruleBlock(rule)),
    ...document.measures.map((one) => measureBlock(one, duration)),
    ...document.flows.map(flowBlock),
    ...[...document.actors]
      .sort((one, other) => Number(other.ego) - Number(one.ego))
      .map((one) => actorBlock(one, durations.get(one.id))),
  ];
}

function ruleBlock(rule: Rule): Block[] {
  const after = afterOf(draftOf(rule).when);
  if (after === null) return [];
  return [
    {
      kind: "rule",
      id: rule.id,
      word: t`Rule of ${rule.actor}`,
      begin: after,
      end: null,
      ends: false,
      until: after,
      category: null,
    },
  ];
}

/** The time that a rule waits for, if it waits for one. */
function afterOf(condition: Condition): number | null {
  if (isGroup(condition)) {
    for (const one of condition.of) {
      const found = afterOf(one);
      if (found !== null) return found;
    }
    return null;
  }
  return condition.kind === "time" ? Number(condition.values.after ?? 0) : null;
}

/** The same condition that waits for another time; only the first that does is changed. */
function waitingUntil(condition: Condition, after: number): Condition {
  if (!isGroup(condition))
    return condition.kind === "time" ? { ...condition, values: { ...condition.values, after } } : condition;
  const first = condition.of.findIndex((one) => afterOf(one) !== null);
  return {
    ...condition,
    of: condition.of.map((one, n) => (n === first ? waitingUntil(one, after) : one)),
  };
}

const measureBlock = (measure: Measure, duration: number): Block => ({
  kind: "measure",
  id: measure.id,
  word: KIND()[measure.kind],
  begin: measure.begin,
  end: measure.end,
  ends: true,
  until: measure.end ?? Math.max(duration, measure.begin),
  category: null,
});

const flowBlock = (flow: Flow): Block => ({
  kind: "flow",
  id: flow.id,
  word: flowWord("pedestrian" in flow.mix),
  begin: flow.begin,
  end: flow.end,
  ends: true,
  until: flow.end,
  category: null,
});

const actorBlock = (actor: Actor, duration = 0): Block => ({
  kind: "actor",
  id: actor.id,
  word: actor.ego ? t`${CATEGORY_WORD()[actor.category]}, ego` : CATEGORY_WORD()[actor.category],
  begin: actor.depart,
  end: null,
  ends: false,
  // The plan may be that of another departure; the route takes as long.
  until: actor.depart + duration,
  category: actor.category,
});

/** A block that is moved, or one end of it, by so many seconds; it stays between 0 and the end of the run. */
export function moved(block: Times, grip: Grip, by: number, longest: number): Times {
  const { begin, end } = block;
  const tidy = (value: number): number => Number(value.toFixed(3));
  if (grip === "end") {
    const from = end ?? longest;
    const most = Math.max(longest, from);
    return { begin, end: tidy(Math.min(most, Math.max(begin + LEAST, from + by))) };
  }
  if (grip === "begin") {
    const most = (end ?? Math.max(longest, begin + LEAST)) - LEAST;
    return { begin: tidy(Math.min(most, Math.max(0, begin + by))), end };
  }
  // As a whole it keeps its length; a flow may reach beyond the run, as it may where it is.
  const shift = Math.max(-begin, Math.min(by, Math.max(longest - begin, 0)));
  return { begin: tidy(begin + shift), end: end === null ? null : tidy(end + shift) };
}

/** The edit that gives something its times, and what undo calls it. */
export function editOf(
  document: ScenarioDocument,
  { kind, id }: Pick<Block, "kind" | "id">,
  { begin, end }: Times,
): { edit: Edit; label: string } | null {
  switch (kind) {
    case "actor":
      return {
        edit: { kind: "change_actor", actor: id, depart: begin },
        label: t`Departure of ${id}`,
      };
    case "flow":
      return {
        edit: { kind: "change_flow", flow: id, begin, ...(end !== null && { end }) },
        label: t`Time of ${id}`,
      };
    case "measure": {
      const measure = document.measures.find((one) => one.id === id);
      if (!measure) return null;
      return {
        edit: { kind: "set_measure", measure: { ...measure, begin, end } },
        label: t`Time of ${id}`,
      };
    }
    case "rule": {
      const rule = document.rules.find((one) => one.id === id);
      if (!rule) return null;
      const draft = draftOf(rule);
      return {
        edit: { kind: "set_rule", rule: ruleOf({ ...draft, when: waitingUntil(draft.when, begin) }) },
        label: t`Time of ${id}`,
      };
    }
  }
}

/** When a block is, in words. */
export function wordsOf({ kind, ends }: Block, { begin, end }: Times, until: number): string {
  if (kind === "rule") return t`after ${clock(begin)}`;
  if (ends) return t`${clock(begin)} to ${end === null ? t`the end` : clock(end)}`;
  return until > begin
    ? t`departs ${clock(begin)}, planned to arrive ${clock(until)}`
    : t`departs ${clock(begin)}`;
}
