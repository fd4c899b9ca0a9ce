import { plural, t } from "@lingui/core/macro";

import { localized } from "../../language/localized";
import type { ScenarioDocument } from "../../api/types";
import {
  amount,
  given,
  type Kind,
  light,
  lightText,
  maybe,
  movement,
  movementText,
  number,
  OWN,
  place,
  SIDEWAYS,
  sidewaysWords,
  speed,
  text,
  TO,
  type Values,
} from "./fields";
import { DRIVERS, sentence } from "../../ui/words";

type Action = ScenarioDocument["rules"][number]["then"][number];
export type ActionKind = Exclude<keyof Action, "together">;

function side(by: unknown): string {
  if (typeof by !== "number") return "…";
  const lanes = Math.abs(by);
  return by < 0
    ? plural(lanes, { one: "# lane to the right", other: "# lanes to the right" })
    : plural(lanes, { one: "# lane to the left", other: "# lanes to the left" });
}

const SHAPES = localized(() => ({
  linear: t`Linear`,
  cosine: t`Half-cosine`,
  cubic: t`Cubic`,
  step: t`At once`,
}));
const isStep = (values: Values): boolean => values.shape === "step";

const LIGHTS = localized((): Record<string, string> => ({
  brake: t`brake lights`,
  front: t`headlights`,
  high_beam: t`high beam`,
  fog: t`fog lights`,
  emergency: t`emergency lights`,
}));
function lightWords(values: Values): string {
  const on = Object.entries(LIGHTS()).flatMap(([name, word]) => (values[name] === true ? [word] : []));
  if (given(values.indicator) && values.indicator !== "off")
    on.unshift(t`indicator ${text(values.indicator)}`);
  const any = Object.values(values).some(given);
  return any
    ? t`set lights: ${on.length > 0 ? on.join(", ") : t`all off`}`
    : t`leave the lights to the driver`;
}

function ignored({ red, right_of_way: right }: Values): string {
  const what = [...(red === false ? [] : [t`red lights`]), ...(right === true ? [t`right of way`] : [])];
  return t`ignore ${what.length > 0 ? what.join(t` and `) : t`nothing`}`;
}

function pathWords(values: Values): string {
  const { points, speeds, times } = values;
  const many = Array.isArray(points) ? points.length : 0;
  const timed = Array.isArray(times) && times.length > 0;
  const paced = Array.isArray(speeds) && speeds.length > 0;
  const how = timed
    ? t`, with a time at each`
    : paced
      ? t`, with a speed at each`
      : maybe(values.speed, t` at`, "km/h", 3.6);
  const from = given(values.relative_to) ? t` ahead of where ${text(values.relative_to)} is` : "";
  const through = plural(many, { one: "# point", other: "# points" });
  return t`follow a path through ${through}${from}${how}`;
}

/** Every kind of action that a document can have. */
export const ACTION_KINDS = localized((): Record<ActionKind, Kind> => ({
  cut_in: {
    label: t`Cut in`,
    only: "vehicles",
    fields: [TO(), ...SIDEWAYS(), number("gap", t`Final gap`, " m", undefined, { min: 0.1 })],
    words: (v) => t`cut in before ${text(v.to)}` + sidewaysWords(v) + maybe(v.gap, t` with a gap of`, "m"),
  },
  lane: {
    label: t`Change lane`,
    only: "vehicles",
    fields: [
      {
        is: "one",
        label: t`Which lane`,
        of: [
          number("by", t`Lanes to the left (negative: right)`, "", 1, { min: -10, max: 10, digits: 0 }),
          place("to", t`Lane to a place`),
        ],
      },
      ...SIDEWAYS(),
      number("offset", t`Then left of the lane's centre`, " m", undefined, { min: -10, max: 10, digits: 2 }),
    ],
    words: (v) =>
      t`change ${given(v.to) ? t`to the lane to ${text(v.to)}` : side(v.by)}` +
      sidewaysWords(v) +
      maybe(v.offset, t`, to an offset of`, "m"),
  },
  speed: {
    label: t`Reach a speed`,
    fields: [
      speed("to", t`Speed`, 10),
      { is: "choice", name: "shape", label: t`Change of speed`, choices: SHAPES() },
      {
        is: "one",
        label: t`How`,
        of: [
          number("rate", t`At a rate`, " m/s²", 2, { min: 0.1, max: 100 }),
          number("over", t`In a time`, " s", 3, { min: 0.1 }),
          number("within", t`In a distance`, " m", 20, { min: 0.1 }),
        ],
        without: isStep,
      },
    ],
    words: (v) => {
      if (isStep(v)) return t`set speed to ${amount(v.to, "km/h", 3.6)}`;
      const how = given(v.rate)
        ? t`at ${amount(v.rate, "m/s²")}`
        : given(v.over)
          ? t`over ${amount(v.over, "s")}`
          : t`within ${amount(v.within, "m")}`;
      return t`reach ${amount(v.to, "km/h", 3.6)} ${how}${v.shape === "cosine" || v.shape === "cubic" ? t`, smoothly` : ""}`;
    },
  },
  brake: {
    label: t`Brake`,
    fields: [
      number("by", t`Deceleration`, " m/s²", 6, { min: 0.1, max: 100 }),
      number("hold", t`Drives on after`, " s", undefined, { max: 1e6 }),
    ],
    words: (v) =>
      t`brake at ${amount(v.by, "m/s²")} to a standstill` + maybe(v.hold, t` and drive on after`, "s"),
  },
  stop: {
    label: t({ message: "Stop", context: "a vehicle" }),
    fields: [number("within", t`Within`, " m", undefined, { min: 0.1 })],
    words: (v) => (given(v.within) ? t`stop within ${amount(v.within, "m")}` : t`stop at once`),
  },
  go: { label: t`Resume`, fields: [], words: () => t`resume its own speed` },
  offset: {
    label: t`Move within the lane`,
    only: "vehicles",
    fields: [
      number("to", t`Left of the lane's centre`, " m", 0.5, { min: -10, max: 10, digits: 2 }),
      ...SIDEWAYS(),
    ],
    words: (v) => {
      const far = amount(typeof v.to === "number" ? Math.abs(v.to) : v.to, "m");
      return (
        (typeof v.to === "number" && v.to < 0
          ? t`move to ${far} right of the lane's centre`
          : t`move to ${far} left of the lane's centre`) + sidewaysWords(v)
      );
    },
  },
  keep_gap: {
    label: t`Keep a gap`,
    only: "vehicles",
    fields: [
      TO(),
      {
        is: "one",
        label: t`Gap`,
        of: [
          number("metres", t`In metres`, " m", 10, { min: 0.1 }),
          number("seconds", t`In seconds`, " s", 2, { min: 0.1 }),
        ],
      },
      { is: "flag", name: "ahead", label: t`Ahead of it, not behind`, otherwise: false },
      number("rate", t`Acceleration at most`, " m/s²", 3, { min: 0.1, max: 100 }),
      number("braking", t`Deceleration at most, if another`, " m/s²", undefined, { min: 0.1, max: 100 }),
      number("lasting", t`For`, " s", undefined, { min: 0.1 }),
      { is: "flag", name: "once", label: t`Only until it is reached`, otherwise: false },
    ],
    words: (v) => {
      const gap = given(v.metres) ? amount(v.metres, "m") : amount(v.seconds, "s");
      const whom = v.ahead === true ? t`ahead of ${text(v.to)}` : t`to ${text(v.to)}`;
      const how = t`, at ${amount(v.rate, "m/s²")} at most` + maybe(v.lasting, t`, for`, "s");
      return v.once === true ? t`reach a gap of ${gap} ${whom}${how}` : t`keep a gap of ${gap} ${whom}${how}`;
    },
  },
  walk: {
    label: t`Walk to`,
    only: "pedestrians",
    fields: [
      place("to", t`Place`),
      { is: "points", name: "through", label: t`Through`, timed: false },
      number("speed", t`Speed`, " km/h", undefined, { min: 0.1, max: 54, scale: 3.6 }),
    ],
    words: (v) => {
      const through =
        Array.isArray(v.through) && v.through.length > 0
          ? ` ${plural(v.through.length, { one: "through # other", other: "through # others" })}`
          : "";
      return t`walk to ${text(v.to)}${through}${maybe(v.speed, t` at`, "km/h", 3.6)}`;
    },
  },
  goal: {
    label: t`Change its goal`,
    fields: [{ is: "place", name: "to", label: t`Goal`, by: "goal", hint: t`a node` }],
    words: (v) => t`go to ${text(v.to)} instead`,
  },
  path: {
    label: t`Follow a path`,
    fields: [
      { is: "points", name: "points", label: t`Points`, timed: true },
      {
        is: "actor",
        name: "relative_to",
        label: t`Metres ahead and left of (empty: places of the map)`,
        optional: true,
      },
    ],
    words: pathWords,
  },
  replay: {
    label: t`Follow a recorded trajectory`,
    fields: [{ is: "rows", name: "rows", label: t`Trajectory` }],
    words: (v) => t`follow a trajectory of ${Array.isArray(v.rows) ? v.rows.length : 0} recorded rows`,
  },
  arrive: {
    label: t`Arrive together`,
    fields: [
      place("at", t`Arrives at`),
      TO(),
      place("when_at", t`When the other one is at`),
      number("speed", t`Speed on arrival`, " km/h", undefined, { max: 360, scale: 3.6 }),
      {
        ...number("steady", t`Reached before the place`, " m"),
        without: (v) => !given(v.speed) && !v.steady,
      },
    ],
    words: (v) =>
      t`arrive at ${text(v.at)} when ${text(v.to)} is at ${text(v.when_at)}` +
      maybe(v.speed, t`, at`, "km/h", 3.6) +
      (v.steady === 0 ? "" : maybe(v.steady, t` for the last`, "m")),
  },
  appear: {
    label: t`Appear`,
    fields: [
      { is: "pose", name: "at", label: t`Appears at` },
      number("speed", t`Speed`, " km/h", undefined, { max: 360, scale: 3.6 }),
    ],
    words: (v) =>
      t`appear${Array.isArray(v.at) ? t` at ${text(v.at.slice(0, 2))}` : ""}${maybe(v.speed, t` at`, "km/h", 3.6)}`,
  },
  end: { label: t`End the run`, fields: [], words: () => t`end the run` },
  vanish: { label: t`Leave the simulation`, fields: [], words: () => t`leave the simulation` },
  signal: {
    label: t`Switch a traffic light`,
    fields: [
      light(),
      {
        is: "choice",
        name: "shows",
        label: t({ message: "To", context: "a state" }),
        choices: { green: t`Green for a movement`, off: t`Off`, program: t`Its program` },
      },
      { ...movement(), without: (values) => values.shows === "off" || values.shows === "program" },
    ],
    words: (v) => {
      if (v.shows === "off") return t`switch the light at ${lightText(v.light)} off`;
      if (v.shows === "program") return t`let the light at ${lightText(v.light)} run its program again`;
      return t`switch the light at ${lightText(v.light)} to green (${movementText(v.light, v.movement)})`;
    },
  },
  lights: {
    label: t`Set its lights`,
    only: "vehicles",
    fields: [
      {
        is: "choice",
        name: "indicator",
        label: t`Indicator`,
        choices: { off: t`Off`, left: t`Left`, right: t`Right`, hazard: t`Hazard lights` },
        optional: true,
      },
      ...Object.entries(LIGHTS()).map(([name, word]) => ({
        is: "choice" as const,
        name,
        label: sentence(word),
        choices: { true: t`On`, false: t`Off` },
        optional: true,
      })),
    ],
    words: lightWords,
  },
  horn: { label: t`Sound the horn`, only: "vehicles", fields: [], words: () => t`sound the horn` },
  ignore: {
    label: t`Ignore traffic rules`,
    only: "vehicles",
    fields: [
      { is: "flag", name: "red", label: t`Red lights`, otherwise: true },
      { is: "flag", name: "right_of_way", label: t`Right of way`, otherwise: false },
    ],
    words: ignored,
  },
  release: { label: t`Release`, fields: [], words: () => t`drive as if there had been no rule` },
  drive: {
    label: t`Change its driver`,
    only: "vehicles",
    fields: [{ is: "choice", name: "by", label: t`Driven by`, choices: DRIVERS() }],
    words: (v) => (v.by === "sumo" ? t`be driven by SUMO` : t`keep speed and lane, whatever is in the way`),
  },
  own: {
    label: t`From a plug-in`,
    fields: OWN(),
    words: (v) => t`do ${text(v.kind)} of a plug-in`,
  },
}));

export const actionKind = (kind: string): Kind | undefined =>
  (ACTION_KINDS() as Partial<Record<string, Kind>>)[kind];

/** Whether a road user of a rule can do something: one on foot, or a vehicle. */
export const canDo = (kind: string, onFoot: boolean): boolean =>
  (actionKind(kind)?.only ?? (onFoot ? "pedestrians" : "vehicles")) === (onFoot ? "pedestrians" : "vehicles");
