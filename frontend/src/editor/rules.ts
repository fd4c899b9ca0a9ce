import type { EditOf, ScenarioDocument } from "../api/types";

export type Rule = ScenarioDocument["rules"][number];
type SentRule = EditOf<"set_rule">["rule"];
type ConditionKind = Exclude<keyof Rule["when"], "all" | "any" | "not" | "delay" | "edge">;
type ActionKind = Exclude<keyof Rule["then"][number], "together">;

/** Fields of a condition or action, without those that are not given. */
export type Values = Record<string, unknown>;

/** A field of the form; `scale` is how many of its unit are one of the document's. */
export type Field =
  | {
      is: "number";
      name: string;
      label: string;
      suffix: string;
      min: number;
      max: number;
      digits?: number;
      scale?: number;
      /** What a new one begins with; without it the field may be empty. */
      start?: number;
    }
  | { is: "actor"; name: string; label: string; optional?: boolean }
  | { is: "place"; name: string; label: string }
  | { is: "rule"; name: string; label: string }
  | { is: "text"; name: string; label: string }
  | { is: "choice"; name: string; label: string; choices: Record<string, string> }
  /** One of these, by their labels. */
  | { is: "one"; label: string; of: readonly Exclude<Field, { is: "one" }>[] };

interface Kind {
  label: string;
  fields: readonly Field[];
  words: (values: Values, actor: string) => string;
  /** Other fields that may have these values and then need no words. */
  silent?: Values;
}

const number = (
  name: string,
  label: string,
  suffix: string,
  start?: number,
  more: { min?: number; max?: number; digits?: number; scale?: number } = {},
): Extract<Field, { is: "number" }> => ({
  is: "number",
  name,
  label,
  suffix,
  min: 0,
  max: 1e4,
  start,
  ...more,
});
const speed = (name: string, label: string, start?: number) =>
  number(name, label, " km/h", start, { max: 360, scale: 3.6, digits: 1 });
const place = (name: string, label: string): Extract<Field, { is: "place" }> => ({
  is: "place",
  name,
  label,
});
const OF: Field = { is: "actor", name: "of", label: "Whose (its own if empty)", optional: true };
const TO: Field = { is: "actor", name: "to", label: "Other road user" };
const OVER = number("over", "Duration", " s", 3, { min: 0.1, digits: 1 });
const bound = (suffix: string, start: number, scale?: number): Field => ({
  is: "one",
  label: "Bound",
  of: [
    number("below", "Below", suffix, start, { digits: 2, scale }),
    number("above", "Above", suffix, start, { digits: 2, scale }),
  ],
});

const text = (value: unknown): string =>
  Array.isArray(value)
    ? value.map((one) => (typeof one === "number" ? String(Number(one.toFixed(2))) : "?")).join(", ")
    : typeof value === "string" && value
      ? value
      : "…";
const given = (value: unknown): boolean => value !== undefined && value !== null;
const amount = (value: unknown, unit: string, scale = 1): string =>
  typeof value === "number" ? `${Number((value * scale).toFixed(2))} ${unit}` : `… ${unit}`;
const optional = (value: unknown, words: string, unit: string): string =>
  given(value) ? `${words} ${amount(value, unit)}` : "";
const limit = (values: Values, unit: string, scale = 1): string =>
  given(values.above)
    ? `above ${amount(values.above, unit, scale)}`
    : `below ${amount(values.below, unit, scale)}`;
const whose = (values: Values, actor: string): string => (given(values.of) ? text(values.of) : actor);
const between = (values: Values): string =>
  given(values.of) ? `of ${text(values.of)} to ${text(values.to)}` : `to ${text(values.to)}`;

const ALONG = {
  straight: "Straight",
  longitudinal: "Along the heading",
  lateral: "To the side",
  lane: "Along the lane",
};
const ALONG_WORD: Record<string, string> = {
  longitudinal: " along the heading",
  lateral: " to the side",
  lane: " along the lane",
};

/** Conditions that the form knows; the others are shown as JSON. */
export const CONDITION_KINDS = {
  ttc: {
    label: "Time to collision",
    fields: [TO, bound(" s", 3), OF],
    words: (v) => `time to collision ${between(v).replace(/^to /, "with ")} is ${limit(v, "s")}`,
  },
  time: {
    label: "Time",
    fields: [number("after", "After", " s", 10, { digits: 1, max: 1e6 })],
    words: (v) => `time is ${amount(v.after, "s")} or more`,
  },
  headway: {
    label: "Time headway",
    fields: [TO, bound(" s", 2), OF],
    words: (v) => `time headway ${between(v)} is ${limit(v, "s")}`,
  },
  distance: {
    label: "Distance",
    fields: [
      {
        is: "one",
        label: "To",
        of: [{ is: "actor", name: "to", label: "Other road user" }, place("place", "Place")],
      },
      bound(" m", 20),
      { is: "choice", name: "along", label: "Measured", choices: ALONG },
      OF,
    ],
    words: (v) => {
      const from = given(v.of) ? `of ${text(v.of)} ` : "";
      const end = given(v.place) ? v.place : v.to;
      return `distance ${from}to ${text(end)}${ALONG_WORD[text(v.along)] ?? ""} is ${limit(v, "m")}`;
    },
    silent: { free: true },
  },
  speed: {
    label: "Speed",
    fields: [bound(" km/h", 10, 3.6), OF],
    words: (v, actor) => `speed of ${whose(v, actor)} is ${limit(v, "km/h", 3.6)}`,
  },
  reaches: {
    label: "Reaches a place",
    fields: [
      place("place", "Place"),
      number("within", "Within", " m", 5, { min: 0.1, max: 1000, digits: 1 }),
      OF,
    ],
    words: (v, actor) => `${whose(v, actor)} is within ${amount(v.within, "m")} of ${text(v.place)}`,
  },
  stopped: {
    label: "Is stopped",
    fields: [number("seconds", "For", " s", 2, { digits: 1 }), OF],
    words: (v, actor) => `${whose(v, actor)} has been stopped for ${amount(v.seconds, "s")}`,
  },
  signal: {
    label: "Traffic light",
    fields: [
      { is: "text", name: "light", label: "Junction of the light" },
      { is: "text", name: "movement", label: "Movement (r1>r2)" },
      {
        is: "choice",
        name: "shows",
        label: "Shows",
        choices: { red: "Red", yellow: "Yellow", green: "Green" },
      },
    ],
    words: (v) => `light ${text(v.light)} shows ${text(v.shows)} for ${text(v.movement)}`,
  },
  rule: {
    label: "Another rule",
    fields: [
      { is: "rule", name: "id", label: "Rule" },
      { is: "choice", name: "has", label: "Has", choices: { ended: "Ended", started: "Started" } },
    ],
    words: (v) => `rule ${text(v.id)} has ${text(v.has)}`,
  },
} satisfies Partial<Record<ConditionKind, Kind>>;

const side = (by: unknown): string =>
  typeof by === "number"
    ? `${Math.abs(by)} lane${Math.abs(by) === 1 ? "" : "s"} to the ${by < 0 ? "right" : "left"}`
    : "…";

/** Actions that the form knows; the others are shown as JSON. */
export const ACTION_KINDS = {
  cut_in: {
    label: "Cut in",
    fields: [TO, OVER, number("gap", "Gap in the end", " m", undefined, { min: 0.1, digits: 1 })],
    words: (v) =>
      `cut in before ${text(v.to)} over ${amount(v.over, "s")}` + optional(v.gap, " with a gap of", "m"),
  },
  lane: {
    label: "Change lane",
    fields: [
      {
        is: "one",
        label: "Which lane",
        of: [
          number("by", "Lanes to the left (negative: right)", "", 1, { min: -10, max: 10, digits: 0 }),
          place("to", "Lane to a place"),
        ],
      },
      OVER,
    ],
    words: (v) =>
      `change ${given(v.to) ? `to the lane to ${text(v.to)}` : side(v.by)} over ${amount(v.over, "s")}`,
  },
  speed: {
    label: "Reach a speed",
    fields: [
      speed("to", "Speed", 10),
      {
        is: "one",
        label: "How",
        of: [
          number("rate", "At a rate", " m/s²", 2, { min: 0.1, max: 100, digits: 1 }),
          number("over", "In a time", " s", 3, { min: 0.1, digits: 1 }),
          number("within", "In a distance", " m", 20, { min: 0.1, digits: 1 }),
        ],
      },
    ],
    words: (v) => {
      const how = given(v.rate)
        ? `at ${amount(v.rate, "m/s²")}`
        : given(v.over)
          ? `over ${amount(v.over, "s")}`
          : `within ${amount(v.within, "m")}`;
      return `reach ${amount(v.to, "km/h", 3.6)} ${how}`;
    },
    silent: { shape: "linear" },
  },
  brake: {
    label: "Brake",
    fields: [
      number("by", "Deceleration", " m/s²", 6, { min: 0.1, max: 100, digits: 1 }),
      number("hold", "Drives on after", " s", undefined, { digits: 1 }),
    ],
    words: (v) =>
      `brake at ${amount(v.by, "m/s²")} to a standstill` + optional(v.hold, " and drive on after", "s"),
  },
  stop: {
    label: "Stop",
    fields: [number("within", "Within", " m", undefined, { min: 0.1, digits: 1 })],
    words: (v) => (given(v.within) ? `stop within ${amount(v.within, "m")}` : "stop at once"),
  },
  go: { label: "Resume", fields: [], words: () => "resume its own speed" },
  offset: {
    label: "Move within the lane",
    fields: [number("to", "Left of the lane's centre", " m", 0.5, { min: -10, max: 10, digits: 2 }), OVER],
    words: (v) =>
      `move to ${amount(typeof v.to === "number" ? Math.abs(v.to) : v.to, "m")} ${
        typeof v.to === "number" && v.to < 0 ? "right" : "left"
      } of the lane's centre over ${amount(v.over, "s")}`,
  },
  keep_gap: {
    label: "Keep a gap",
    fields: [
      TO,
      {
        is: "one",
        label: "Gap",
        of: [
          number("metres", "In metres", " m", 10, { min: 0.1, digits: 1 }),
          number("seconds", "In seconds", " s", 2, { min: 0.1, digits: 1 }),
        ],
      },
      number("rate", "Acceleration at most", " m/s²", 3, { min: 0.1, max: 100, digits: 1 }),
      number("lasting", "For", " s", undefined, { min: 0.1, digits: 1 }),
    ],
    words: (v) =>
      `keep a gap of ${given(v.metres) ? amount(v.metres, "m") : amount(v.seconds, "s")} to ${text(v.to)}` +
      `, at ${amount(v.rate, "m/s²")} at most` +
      optional(v.lasting, ", for", "s"),
  },
  walk: {
    label: "Walk to",
    fields: [
      place("to", "Place"),
      number("speed", "Speed", " km/h", undefined, { min: 0.1, max: 54, digits: 1, scale: 3.6 }),
    ],
    words: (v) => `walk to ${text(v.to)}${given(v.speed) ? ` at ${amount(v.speed, "km/h", 3.6)}` : ""}`,
    silent: { through: [] },
  },
  arrive: {
    label: "Arrive together",
    fields: [place("at", "Arrives at"), TO, place("when_at", "When the other one is at")],
    words: (v) => `arrive at ${text(v.at)} when ${text(v.to)} is at ${text(v.when_at)}`,
  },
  vanish: { label: "Leave the simulation", fields: [], words: () => "leave the simulation" },
  release: { label: "Release", fields: [], words: () => "drive as if there had been no rule" },
} satisfies Partial<Record<ActionKind, Kind>>;

export type Item = { kind: string; values: Values };

/** A rule as its form has it. */
export interface Draft {
  id: string;
  actor: string;
  join: "all" | "any";
  conditions: readonly Item[];
  delay: number;
  actions: readonly Item[];
  times: number;
}

export const conditionKind = (kind: string): Kind | undefined =>
  (CONDITION_KINDS as Partial<Record<string, Kind>>)[kind];
export const actionKind = (kind: string): Kind | undefined =>
  (ACTION_KINDS as Partial<Record<string, Kind>>)[kind];

const entries = (part: object): [string, unknown][] =>
  Object.entries(part).filter(([, value]) => given(value));

/** A condition or action as its kind and fields, if the form knows both. */
function itemOf(part: object, kindOf: (kind: string) => Kind | undefined): Item | null {
  const found = entries(part).filter(([name]) => name !== "delay" && name !== "edge");
  const [first] = found;
  if (!first || found.length > 1) return null;
  const [kind, value] = first;
  const known = kindOf(kind);
  if (!known || typeof value !== "object" || value === null) return null;
  const names = new Set(
    known.fields.flatMap((field) => (field.is === "one" ? field.of : [field]).map(({ name }) => name)),
  );
  const values = entries(value);
  const silent = known.silent ?? {};
  const understood = values.every(
    ([name, one]) => names.has(name) || JSON.stringify(silent[name]) === JSON.stringify(one),
  );
  return understood ? { kind, values: Object.fromEntries(values) } : null;
}

const whole = <T>(items: readonly (T | null)[]): T[] | null => {
  const found = items.filter((one) => one !== null);
  return found.length === items.length ? found : null;
};

/** The rule as its form has it; null if it has something that the form does not know. */
export function draftOf(rule: Rule): Draft | null {
  const { all, any, delay, edge } = rule.when;
  const parts = all ?? any ?? [rule.when];
  const plain = parts.every((one) => one === rule.when || (one.delay === 0 && one.edge === "none"));
  const conditions = whole(parts.map((one) => itemOf(one, conditionKind)));
  const actions = whole(rule.then.map((one) => itemOf(one, actionKind)));
  if (!plain || edge !== "none" || !conditions || !actions) return null;
  return {
    id: rule.id,
    actor: rule.actor,
    join: any ? "any" : "all",
    conditions,
    delay,
    actions,
    times: rule.times,
  };
}

/** The rule that is sent. */
export function ruleOf({ id, actor, join, conditions, delay, actions, times }: Draft): SentRule {
  const parts = conditions.map(({ kind, values }) => ({ [kind]: values }));
  const when = { ...(parts.length === 1 ? parts[0] : { [join]: parts }), delay };
  return {
    id,
    actor,
    when,
    then: actions.map(({ kind, values }) => ({ [kind]: values })),
    times,
  } as SentRule;
}

/** "When time to collision with ego is below 3 s, change 1 lane to the left over 3 s." */
export function sentence({ actor, join, conditions, delay, actions, times }: Draft): string {
  const when = conditions
    .map(({ kind, values }) => conditionKind(kind)?.words(values, actor) ?? kind)
    .join(join === "all" ? " and " : " or ");
  const then = actions
    .map(({ kind, values }) => actionKind(kind)?.words(values, actor) ?? kind)
    .join(", then ");
  const wait = delay > 0 ? `, ${amount(delay, "s")} later` : "";
  return `When ${when}${wait}, ${then}${times > 1 ? `, up to ${times} times` : ""}.`;
}

/** A value that a new field begins with. */
function startOf(field: Exclude<Field, { is: "one" }>, others: readonly string[]): unknown {
  switch (field.is) {
    case "number":
      return field.start === undefined ? undefined : field.start / (field.scale ?? 1);
    case "actor":
      return field.optional ? undefined : (others[0] ?? "");
    case "choice":
      return Object.keys(field.choices)[0];
    default:
      return "";
  }
}

export function fieldStart(field: Field, others: readonly string[]): Values {
  const one = field.is === "one" ? field.of[0] : field;
  const value = one && startOf(one, others);
  return one && given(value) ? { [one.name]: value } : {};
}

/** A new condition or action of a kind; `others` are the road users it may be about, best first. */
export const newItem = (kind: string, known: Kind | undefined, others: readonly string[]): Item => ({
  kind,
  values: Object.assign({}, ...(known?.fields ?? []).map((field) => fieldStart(field, others))) as Values,
});

/** Labels of what still has to be given. */
export function missing({ actor, conditions, actions }: Draft): string[] {
  const of = ({ values }: Item, known: Kind | undefined): string[] =>
    (known?.fields ?? [])
      .flatMap((field) => (field.is === "one" ? field.of : [field]))
      .filter(({ name }) => values[name] === "")
      .map(({ label }) => label);
  return [
    ...(actor ? [] : ["Who acts"]),
    ...conditions.flatMap((one) => of(one, conditionKind(one.kind))),
    ...actions.flatMap((one) => of(one, actionKind(one.kind))),
  ];
}

/** A place as it is typed: a node, or x and y in metres. */
export function readPlace(typed: string): string | [number, number] {
  const pair = /^(-?\d+(?:\.\d+)?)\s*[,;]\s*(-?\d+(?:\.\d+)?)$/.exec(typed.trim());
  return pair ? [Number(pair[1]), Number(pair[2])] : typed.trim();
}

export const placeText = (value: unknown): string =>
  Array.isArray(value) ? value.join(", ") : typeof value === "string" ? value : "";
