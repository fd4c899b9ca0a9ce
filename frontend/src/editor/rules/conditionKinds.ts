import type { ScenarioDocument } from "../../api/types";
import {
  amount,
  between,
  bound,
  given,
  type Kind,
  light,
  limit,
  movement,
  number,
  OF,
  OWN,
  place,
  text,
  TO,
  whose,
} from "./fields";

type Condition = ScenarioDocument["rules"][number]["when"];
export type ConditionKind = Exclude<keyof Condition, "all" | "any" | "not" | "delay" | "edge">;

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

/** Every kind of condition that a document can have. */
export const CONDITION_KINDS: Record<ConditionKind, Kind> = {
  ttc: {
    label: "Time to collision",
    fields: [TO, bound(" s", 3), OF],
    words: (v) => `time to collision ${between(v).replace(/^to /, "with ")} is ${limit(v, "s")}`,
  },
  time: {
    label: "Time",
    fields: [number("after", "After", " s", 10, { max: 1e6 })],
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
      { is: "flag", name: "free", label: "Between the bodies, not their centres", otherwise: true },
      OF,
    ],
    words: (v) => {
      const from = given(v.of) ? `of ${text(v.of)} ` : "";
      const end = given(v.place) ? v.place : v.to;
      const centres = v.free === false ? " between centres" : "";
      return `distance ${from}to ${text(end)}${ALONG_WORD[text(v.along)] ?? ""}${centres} is ${limit(v, "m")}`;
    },
  },
  relative_speed: {
    label: "Relative speed",
    fields: [TO, bound(" km/h", 10, 3.6, -1e6), OF],
    words: (v) => `speed relative ${between(v)} is ${limit(v, "km/h", 3.6)}`,
  },
  speed: {
    label: "Speed",
    fields: [bound(" km/h", 10, 3.6), OF],
    words: (v, actor) => `speed of ${whose(v, actor)} is ${limit(v, "km/h", 3.6)}`,
  },
  acceleration: {
    label: "Acceleration",
    fields: [bound(" m/s²", -2, 1, -1e6), OF],
    words: (v, actor) => `acceleration of ${whose(v, actor)} is ${limit(v, "m/s²")}`,
  },
  reaches: {
    label: "Reaches a place",
    fields: [place("place", "Place"), number("within", "Within", " m", 5, { min: 0.1, max: 1000 }), OF],
    words: (v, actor) => `${whose(v, actor)} is within ${amount(v.within, "m")} of ${text(v.place)}`,
  },
  travelled: {
    label: "Distance travelled",
    fields: [bound(" m", 50), OF],
    words: (v, actor) => `distance travelled by ${whose(v, actor)} is ${limit(v, "m")}`,
  },
  stopped: {
    label: "Is stopped",
    fields: [number("seconds", "For", " s", 2), OF],
    words: (v, actor) => `${whose(v, actor)} has been stopped for ${amount(v.seconds, "s")}`,
  },
  signal: {
    label: "Traffic light",
    fields: [
      light(),
      movement(),
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
  appeared: {
    label: "Is on the road",
    fields: [OF],
    words: (v, actor) => `${whose(v, actor)} is on the road`,
  },
  touched: {
    label: "Touches",
    fields: [{ is: "actor", name: "to", label: "Other road user (any if empty)", optional: true }, OF],
    words: (v, actor) => `${whose(v, actor)} touches ${given(v.to) ? text(v.to) : "a road user"}`,
  },
  off_road: {
    label: "Is off the road",
    fields: [OF],
    words: (v, actor) => `${whose(v, actor)} is off the road`,
  },
  own: {
    label: "Of an installed package",
    fields: [...OWN, OF],
    words: (v) => `${text(v.kind)} of an installed package holds`,
  },
};

export const conditionKind = (kind: string): Kind | undefined =>
  (CONDITION_KINDS as Partial<Record<string, Kind>>)[kind];
