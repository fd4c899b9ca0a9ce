import type { Rule, SentRule } from "./draft";

type Condition = Rule["when"];

/**
 * A rule as it is sent, as the document shows it until the server has answered: what it leaves out of conditions
 * is there with its default. Fields that are not given are missing, where a document has null.
 */
export const shownRule = (rule: SentRule): Rule =>
  ({ times: 1, ...rule, when: shownWhen(rule.when) }) as Rule;

const shownWhen = (when: SentRule["when"]): Condition =>
  within({ delay: 0, edge: "none", ...when } as Condition, shownWhen as (one: Condition) => Condition);

/** A rule that waits for the rule `next` wherever it waited for `old`. */
export function waitingFor(rule: Rule, old: string, next: string): Rule {
  const renamed = (when: Condition): Condition =>
    within(when.rule?.id === old ? { ...when, rule: { ...when.rule, id: next } } : when, renamed);
  return { ...rule, when: renamed(rule.when) };
}

/** A condition with its parts changed, if it has some. */
function within(when: Condition, change: (one: Condition) => Condition): Condition {
  return {
    ...when,
    ...(when.all && { all: when.all.map(change) }),
    ...(when.any && { any: when.any.map(change) }),
    ...(when.not && { not: change(when.not) }),
  } as Condition;
}
