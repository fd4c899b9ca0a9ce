import { t } from "@lingui/core/macro";

import { short } from "../../language/numbers";
import type { EditOf, ScenarioDocument } from "../../api/types";
import { actionKind, canDo } from "./actionKinds";
import { conditionKind, momentWords } from "./conditionKinds";
import { type Field, given, type Kind, type PlainField, type Values } from "./fields";

export type Rule = ScenarioDocument["rules"][number];
export type SentRule = EditOf<"set_rule">["rule"];

/** A condition or action of one kind. */
export interface Item {
  kind: string;
  values: Values;
}

interface Timing {
  /** Seconds by which it holds later. */
  delay: number;
  edge: "none" | "rising";
}

/** Several conditions that are combined; of `not` it is one. */
export interface ConditionGroup extends Timing {
  join: Join;
  of: readonly Condition[];
}
export type Join = "all" | "any" | "not";
export type Condition = (Item & Timing) | ConditionGroup;

/** A rule as its form has it; items of `then` that have several actions run them together. */
export interface Draft {
  id: string;
  actor: string;
  when: Condition;
  then: readonly (readonly Item[])[];
  times: number;
  /** Of a new rule: whether a pedestrian whom it moves waits at its place until then. */
  waits?: boolean;
}

export const isGroup = (condition: Condition): condition is ConditionGroup => "join" in condition;
export const NOW: Timing = { delay: 0, edge: "none" };

/** The one part of a condition or action that is given, and its fields. */
function itemOf(part: object): Item {
  const found = Object.entries(part).find(
    ([name, value]) => given(value) && name !== "delay" && name !== "edge",
  );
  const [kind, value] = found ?? ["", {}];
  const values = Object.entries(value as object).filter(([, one]) => given(one));
  return { kind, values: Object.fromEntries(values) };
}

function conditionOf(when: Rule["when"]): Condition {
  const { delay, edge } = when;
  if (when.all) return { join: "all", of: when.all.map(conditionOf), delay, edge };
  if (when.any) return { join: "any", of: when.any.map(conditionOf), delay, edge };
  if (when.not) return { join: "not", of: [conditionOf(when.not)], delay, edge };
  return { ...itemOf(when), delay, edge };
}

/** The rule as its form has it, with everything that a document can say. */
export function draftOf({ id, actor, when, then, times }: Rule): Draft {
  return {
    id,
    actor,
    when: conditionOf(when),
    then: then.map((item) => (item.together ?? [item]).map(itemOf)),
    times,
  };
}

function sentCondition(condition: Condition): object {
  const { delay, edge } = condition;
  const timing = { ...(delay > 0 && { delay }), ...(edge !== "none" && { edge }) };
  if (!isGroup(condition)) return { [condition.kind]: condition.values, ...timing };
  const parts = condition.of.map(sentCondition);
  return { [condition.join]: condition.join === "not" ? parts[0] : parts, ...timing };
}

/** The rule that is sent. */
export function ruleOf({ id, actor, when, then, times }: Draft): SentRule {
  return {
    id: id.trim(),
    actor,
    when: sentCondition(when),
    then: then.map((items) => {
      const parts = items.map(({ kind, values }) => ({ [kind]: values }));
      return parts.length === 1 ? parts[0] : { together: parts };
    }),
    times,
  } as SentRule;
}

/** Whether a new rule is the first to move a pedestrian, who then can wait for it. */
export const canWait = ({ actor, then, waits }: Draft, idle: readonly string[]): boolean =>
  waits !== undefined && idle.includes(actor) && then.flat().some(({ kind }) => kind === "walk");

/** Rules that are sent for a draft: its own, and before it one that keeps a pedestrian of `idle` at its place. */
export function rulesOf(draft: Draft, idle: readonly string[], taken: readonly string[]): SentRule[] {
  const rule = ruleOf(draft);
  if (!draft.waits || !canWait(draft, idle)) return [rule];
  let id = `${rule.id}-wait`;
  while (taken.includes(id)) id += "+";
  return [{ id, actor: rule.actor, when: { time: { after: 0 } }, then: [{ stop: {} }] } as SentRule, rule];
}

/** All conditions of a rule that are not combinations, in order. */
export const leavesOf = (condition: Condition): (Item & Timing)[] =>
  isGroup(condition) ? condition.of.flatMap(leavesOf) : [condition];

// Words

function conditionWords(condition: Condition, actor: string, inner = false): string {
  const { delay, edge } = condition;
  const words = isGroup(condition)
    ? groupWords(condition, actor, inner)
    : (conditionKind(condition.kind)?.words(condition.values, actor) ?? condition.kind);
  const rising = edge === "rising" ? t`${words} (as it becomes true)` : words;
  return delay > 0 ? t`${rising} (${short(delay, 2)} s later)` : rising;
}

function groupWords({ join, of }: ConditionGroup, actor: string, inner: boolean): string {
  const parts = of.map((one) => conditionWords(one, actor, true));
  if (join === "not") return t`not (${parts.join("")})`;
  const words = parts.join(join === "all" ? t` and ` : t` or `);
  return inner && parts.length > 1 ? `(${words})` : words;
}

/** "When time to collision with ego is below 3 s, change 1 lane to the left over 3 s." */
export function sentence({ actor, when, then, times }: Draft): string {
  const { delay, edge } = when;
  const words = conditionWords({ ...when, ...NOW }, actor);
  const first = edge === "rising" ? t`it becomes true that ${words}` : words;
  const wait = delay > 0 ? t`, ${short(delay, 2)} s later` : "";
  const acts = then
    .map((items) =>
      items
        .map(({ kind, values }) => actionKind(kind)?.words(values, actor) ?? kind)
        .join(t` and at the same time `),
    )
    .join(t`, then `);
  const often = times > 1 ? t`, up to ${times} times` : "";
  // A moment that is reached once is said as one.
  if (!isGroup(when) && when.kind === "time" && delay === 0 && edge === "none")
    return t`${momentWords(when.values)}, ${acts}${often}.`;
  return t`When ${first}${wait}, ${acts}${often}.`;
}

// New parts

/** A value that a new field begins with. */
function startOf(field: PlainField, others: readonly string[]): unknown {
  switch (field.is) {
    case "number":
      return field.start === undefined ? undefined : field.start / field.scale;
    case "actor":
      return field.optional ? undefined : (others[0] ?? "");
    case "choice":
      return field.optional || field.otherwise ? undefined : Object.keys(field.choices)[0];
    case "points":
      return [];
    case "flag":
    case "pose":
    case "given":
      return undefined;
    case "rows":
      return [];
    default:
      return "";
  }
}

export const namesOf = (field: Field): string[] =>
  field.is === "one" ? field.of.map(({ name }) => name) : [field.name];

export function fieldStart(field: Field, others: readonly string[]): Values {
  const one = field.is === "one" ? field.of[0] : field;
  const value = one && startOf(one, others);
  return one && given(value) ? { [one.name]: value } : {};
}

/** Values without those that have no meaning with the others, and with those that then must be given. */
export function settled(known: Kind | undefined, values: Values, others: readonly string[]): Values {
  let next = values;
  for (const field of known?.fields ?? []) {
    if (!field.without) continue;
    const names = namesOf(field);
    if (field.without(values))
      next = Object.fromEntries(Object.entries(next).filter(([name]) => !names.includes(name)));
    else if (!names.some((name) => name in next)) next = { ...next, ...fieldStart(field, others) };
  }
  return next;
}

/** A new condition or action of a kind; `others` are the road users it may be about, best first. */
export const newItem = (kind: string, known: Kind | undefined, others: readonly string[]): Item => ({
  kind,
  values: settled(
    known,
    Object.assign({}, ...(known?.fields ?? []).map((one) => fieldStart(one, others))),
    others,
  ),
});

export const newCondition = (kind: string, others: readonly string[]): Condition => ({
  ...newItem(kind, conditionKind(kind), others),
  ...NOW,
});

/** Labels of what is not given yet. */
export function missing({ id, actor, when, then }: Draft): string[] {
  const of = ({ values }: Item, known: Kind | undefined): string[] =>
    (known?.fields ?? [])
      .flatMap((field): readonly PlainField[] => (field.is === "one" ? field.of : [field]))
      .filter(({ name, is }) => {
        const value = values[name];
        const none = Array.isArray(value) && value.length === 0;
        return value === "" || (none && (is === "rows" || (is === "points" && name === "points")));
      })
      .map(({ label }) => label);
  return [
    ...(id.trim() ? [] : [t`Name`]),
    ...(actor ? [] : [t`Who acts`]),
    ...leavesOf(when).flatMap((one) => of(one, conditionKind(one.kind))),
    ...then.flat().flatMap((one) => of(one, actionKind(one.kind))),
  ];
}

/** A place as it is typed: a node, or x and y in metres. */
export function readPlace(typed: string): string | [number, number] {
  const pair = /^(-?\d+(?:\.\d+)?)\s*[,;]\s*(-?\d+(?:\.\d+)?)$/.exec(typed.trim());
  return pair ? [Number(pair[1]), Number(pair[2])] : typed.trim();
}

export const placeText = (value: unknown): string =>
  Array.isArray(value) ? value.join(", ") : typeof value === "string" ? value : "";

/** The first action of a road user: what it does most. */
export const firstAction = (onFoot: boolean, others: readonly string[]): Item => {
  const kind = onFoot ? "walk" : "brake";
  return newItem(kind, actionKind(kind), others);
};

/** Actions for another road user: what it cannot do becomes its first action. */
export const actionsFor = (then: Draft["then"], onFoot: boolean, others: readonly string[]): Draft["then"] =>
  then.map((items) => items.map((one) => (canDo(one.kind, onFoot) ? one : firstAction(onFoot, others))));

/** Metres to the ego at which a pedestrian walks: what a car at 50 km/h needs to stop. */
const WALKS_AT = 30;

/** A rule for a begin: of those without one, the first that is not the ego cuts in, or walks. */
export function newDraft(
  ids: readonly string[],
  rules: readonly Rule[],
  walkers: readonly string[] = [],
): Draft {
  const idle = ids.slice(1).find((id) => rules.every((rule) => rule.actor !== id));
  const actor = idle ?? ids[1] ?? ids[0] ?? "";
  const others = ids.filter((id) => id !== actor);
  const onFoot = walkers.includes(actor);
  const taken = new Set(rules.map(({ id }) => id));
  let number = 1;
  while (taken.has(`rule-${number}`)) number += 1;
  const condition = others.length === 0 ? "time" : onFoot ? "distance" : "ttc";
  const action =
    others.length > 0 && !onFoot
      ? newItem("cut_in", actionKind("cut_in"), others)
      : firstAction(onFoot, others);
  const when = newCondition(condition, others);
  if (condition === "distance" && !isGroup(when)) when.values = { ...when.values, below: WALKS_AT };
  const id = `rule-${number}`;
  return { id, actor, when, then: [[action]], times: 1, waits: true };
}
