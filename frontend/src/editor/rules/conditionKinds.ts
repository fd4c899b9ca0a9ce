import { t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import { clock, hasClock } from "../../language/moments";
import type { ScenarioDocument } from "../../api/types";
import {
  amount,
  between,
  bound,
  given,
  type Kind,
  light,
  lightText,
  limit,
  movement,
  movementText,
  number,
  OF,
  OWN,
  place,
  text,
  TO,
  type Values,
  whose,
} from "./fields";

type Condition = ScenarioDocument["rules"][number]["when"];
export type ConditionKind = Exclude<keyof Condition, "all" | "any" | "not" | "delay" | "edge">;

const ALONG = localized(() => ({
  straight: t`Straight`,
  longitudinal: t`Along the heading`,
  lateral: t`To the side`,
  lane: t`Along the lane`,
}));
const ALONG_WORD = localized((): Record<string, string> => ({
  longitudinal: t` along the heading`,
  lateral: t` to the side`,
  lane: t` along the lane`,
}));

/** Every kind of condition that a document can have. */
export const CONDITION_KINDS = localized((): Record<ConditionKind, Kind> => ({
  ttc: {
    label: t`Time to collision`,
    fields: [TO(), bound(" s", 3), OF()],
    words: (v) =>
      given(v.of)
        ? t`time to collision ${between(v)} is ${limit(v, "s")}`
        : t`time to collision with ${text(v.to)} is ${limit(v, "s")}`,
  },
  time: {
    label: t`Time`,
    fields: [number("after", t`After`, " s", 10, { max: 1e6, moment: true })],
    words: (v) =>
      hasClock() && typeof v.after === "number"
        ? t`it is ${clock(v.after)} or later`
        : t`time is ${amount(v.after, "s")} or more`,
  },
  headway: {
    label: t`Time headway`,
    fields: [TO(), bound(" s", 2), OF()],
    words: (v) => t`time headway ${between(v)} is ${limit(v, "s")}`,
  },
  distance: {
    label: t`Distance`,
    fields: [
      {
        is: "one",
        label: t({ message: "To", context: "a place" }),
        of: [{ is: "actor", name: "to", label: t`Other road user` }, place("place", t`Place`)],
      },
      bound(" m", 20),
      { is: "choice", name: "along", label: t`Measured`, choices: ALONG() },
      { is: "flag", name: "free", label: t`Bumper to bumper`, otherwise: true },
      OF(),
    ],
    words: (v) => {
      const from = given(v.of) ? t`of ${text(v.of)} ` : "";
      const end = given(v.place) ? v.place : v.to;
      const centres = v.free === false ? t` between centres` : "";
      return t`distance ${from}to ${text(end)}${ALONG_WORD()[text(v.along)] ?? ""}${centres} is ${limit(v, "m")}`;
    },
  },
  relative_speed: {
    label: t`Relative speed`,
    fields: [TO(), bound(" km/h", 10, 3.6, -1e6), OF()],
    words: (v) => t`speed relative ${between(v)} is ${limit(v, "km/h", 3.6)}`,
  },
  speed: {
    label: t`Speed`,
    fields: [bound(" km/h", 10, 3.6), OF()],
    words: (v, actor) => t`speed of ${whose(v, actor)} is ${limit(v, "km/h", 3.6)}`,
  },
  acceleration: {
    label: t`Acceleration`,
    fields: [bound(" m/s²", -2, 1, -1e6), OF()],
    words: (v, actor) => t`acceleration of ${whose(v, actor)} is ${limit(v, "m/s²")}`,
  },
  reaches: {
    label: t`Reaches a place`,
    fields: [place("place", t`Place`), number("within", t`Within`, " m", 5, { min: 0.1, max: 1000 }), OF()],
    words: (v, actor) => t`${whose(v, actor)} is within ${amount(v.within, "m")} of ${text(v.place)}`,
  },
  travelled: {
    label: t`Distance travelled`,
    fields: [bound(" m", 50), OF()],
    words: (v, actor) => t`distance travelled by ${whose(v, actor)} is ${limit(v, "m")}`,
  },
  stopped: {
    label: t`Is stopped`,
    fields: [number("seconds", t`For`, " s", 2), OF()],
    words: (v, actor) => t`${whose(v, actor)} has been stopped for ${amount(v.seconds, "s")}`,
  },
  signal: {
    label: t`Traffic light`,
    fields: [
      light(),
      movement(),
      {
        is: "choice",
        name: "shows",
        label: t`Shows`,
        choices: { red: t`Red`, yellow: t`Yellow`, green: t`Green` },
      },
    ],
    words: (v) =>
      t`the light at ${lightText(v.light)} shows ${text(v.shows)} (${movementText(v.light, v.movement)})`,
  },
  rule: {
    label: t`Another rule`,
    fields: [
      { is: "rule", name: "id", label: t`Rule` },
      { is: "choice", name: "has", label: t`Has`, choices: { ended: t`Ended`, started: t`Started` } },
    ],
    words: (v) => t`rule ${text(v.id)} has ${text(v.has)}`,
  },
  appeared: {
    label: t`Is on the road`,
    fields: [OF()],
    words: (v, actor) => t`${whose(v, actor)} is on the road`,
  },
  touched: {
    label: t`Touches`,
    fields: [{ is: "actor", name: "to", label: t`Other road user (any if empty)`, optional: true }, OF()],
    words: (v, actor) => t`${whose(v, actor)} touches ${given(v.to) ? text(v.to) : t`a road user`}`,
  },
  off_road: {
    label: t`Is off the road`,
    fields: [OF()],
    words: (v, actor) => t`${whose(v, actor)} is off the road`,
  },
  own: {
    label: t`From a plug-in`,
    fields: [...OWN(), OF()],
    words: (v) => t`${text(v.kind)} of a plug-in holds`,
  },
}));

export const conditionKind = (kind: string): Kind | undefined =>
  (CONDITION_KINDS() as Partial<Record<string, Kind>>)[kind];

/** The moment from which a condition on time holds, for the beginning of a sentence. */
export const momentWords = (v: Values): string =>
  hasClock() && typeof v.after === "number" ? t`At ${clock(v.after)}` : t`At t = ${amount(v.after, "s")}`;
