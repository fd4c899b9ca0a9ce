import type { ScenarioDocument } from "../../api/types";
import {
  amount,
  given,
  type Kind,
  light,
  maybe,
  movement,
  number,
  OVER,
  OWN,
  place,
  speed,
  text,
  TO,
  type Values,
} from "./fields";
import { sentence } from "../../ui/words";

type Action = ScenarioDocument["rules"][number]["then"][number];
export type ActionKind = Exclude<keyof Action, "together">;

const side = (by: unknown): string =>
  typeof by === "number"
    ? `${Math.abs(by)} lane${Math.abs(by) === 1 ? "" : "s"} to the ${by < 0 ? "right" : "left"}`
    : "…";

const SHAPES = { linear: "Linear", cosine: "Cosine", step: "At once" };
const isStep = (values: Values): boolean => values.shape === "step";

const LIGHTS: Record<string, string> = {
  brake: "brake lights",
  front: "headlights",
  high_beam: "high beam",
  fog: "fog lights",
  emergency: "emergency lights",
};
function lightWords(values: Values): string {
  const on = Object.entries(LIGHTS).flatMap(([name, word]) => (values[name] === true ? [word] : []));
  if (given(values.indicator) && values.indicator !== "off")
    on.unshift(`indicator ${text(values.indicator)}`);
  const any = Object.values(values).some(given);
  return any ? `set lights: ${on.length > 0 ? on.join(", ") : "all off"}` : "leave the lights to the driver";
}

function ignored({ red, right_of_way: right }: Values): string {
  const what = [...(red === false ? [] : ["red lights"]), ...(right === true ? ["right of way"] : [])];
  return `ignore ${what.length > 0 ? what.join(" and ") : "nothing"}`;
}

function pathWords(values: Values): string {
  const { points, speeds, times } = values;
  const many = Array.isArray(points) ? points.length : 0;
  const timed = Array.isArray(times) && times.length > 0;
  const paced = Array.isArray(speeds) && speeds.length > 0;
  const how = timed
    ? ", with a time at each"
    : paced
      ? ", with a speed at each"
      : maybe(values.speed, " at", "km/h", 3.6);
  const from = given(values.relative_to) ? ` ahead of where ${text(values.relative_to)} is` : "";
  return `follow a path through ${many} point${many === 1 ? "" : "s"}${from}${how}`;
}

/** Every kind of action that a document can have. */
export const ACTION_KINDS: Record<ActionKind, Kind> = {
  cut_in: {
    label: "Cut in",
    fields: [TO, OVER, number("gap", "Gap in the end", " m", undefined, { min: 0.1 })],
    words: (v) =>
      `cut in before ${text(v.to)} over ${amount(v.over, "s")}` + maybe(v.gap, " with a gap of", "m"),
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
      { is: "choice", name: "shape", label: "Change of speed", choices: SHAPES },
      {
        is: "one",
        label: "How",
        of: [
          number("rate", "At a rate", " m/s²", 2, { min: 0.1, max: 100 }),
          number("over", "In a time", " s", 3, { min: 0.1 }),
          number("within", "In a distance", " m", 20, { min: 0.1 }),
        ],
        without: isStep,
      },
    ],
    words: (v) => {
      const how = isStep(v)
        ? "at once"
        : given(v.rate)
          ? `at ${amount(v.rate, "m/s²")}`
          : given(v.over)
            ? `over ${amount(v.over, "s")}`
            : `within ${amount(v.within, "m")}`;
      return `reach ${amount(v.to, "km/h", 3.6)} ${how}${v.shape === "cosine" ? ", smoothly" : ""}`;
    },
  },
  brake: {
    label: "Brake",
    fields: [
      number("by", "Deceleration", " m/s²", 6, { min: 0.1, max: 100 }),
      number("hold", "Drives on after", " s", undefined, { max: 1e6 }),
    ],
    words: (v) =>
      `brake at ${amount(v.by, "m/s²")} to a standstill` + maybe(v.hold, " and drive on after", "s"),
  },
  stop: {
    label: "Stop",
    fields: [number("within", "Within", " m", undefined, { min: 0.1 })],
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
          number("metres", "In metres", " m", 10, { min: 0.1 }),
          number("seconds", "In seconds", " s", 2, { min: 0.1 }),
        ],
      },
      { is: "flag", name: "ahead", label: "Ahead of it, not behind", otherwise: false },
      number("rate", "Acceleration at most", " m/s²", 3, { min: 0.1, max: 100 }),
      number("lasting", "For", " s", undefined, { min: 0.1 }),
      { is: "flag", name: "once", label: "Only until it is reached", otherwise: false },
    ],
    words: (v) =>
      `${v.once === true ? "reach" : "keep"} a gap of ` +
      `${given(v.metres) ? amount(v.metres, "m") : amount(v.seconds, "s")} ` +
      `${v.ahead === true ? "ahead of" : "to"} ${text(v.to)}` +
      `, at ${amount(v.rate, "m/s²")} at most` +
      maybe(v.lasting, ", for", "s"),
  },
  walk: {
    label: "Walk to",
    fields: [
      place("to", "Place"),
      { is: "points", name: "through", label: "Through", timed: false },
      number("speed", "Speed", " km/h", undefined, { min: 0.1, max: 54, scale: 3.6 }),
    ],
    words: (v) => {
      const through =
        Array.isArray(v.through) && v.through.length > 0 ? ` through ${v.through.length} others` : "";
      return `walk to ${text(v.to)}${through}${maybe(v.speed, " at", "km/h", 3.6)}`;
    },
  },
  goal: {
    label: "Change its goal",
    fields: [{ is: "place", name: "to", label: "Goal", by: "goal", hint: "a node" }],
    words: (v) => `go to ${text(v.to)} instead`,
  },
  path: {
    label: "Follow a path",
    fields: [
      { is: "points", name: "points", label: "Points", timed: true },
      {
        is: "actor",
        name: "relative_to",
        label: "Metres ahead and left of (empty: places of the map)",
        optional: true,
      },
    ],
    words: pathWords,
  },
  replay: {
    label: "Follow a recorded trajectory",
    fields: [{ is: "rows", name: "rows", label: "Trajectory" }],
    words: (v) => `follow a trajectory of ${Array.isArray(v.rows) ? v.rows.length : 0} recorded rows`,
  },
  arrive: {
    label: "Arrive together",
    fields: [
      place("at", "Arrives at"),
      TO,
      place("when_at", "When the other one is at"),
      number("speed", "Speed on arrival", " km/h", undefined, { max: 360, scale: 3.6 }),
      {
        ...number("steady", "Reached before the place", " m"),
        without: (v) => !given(v.speed) && !v.steady,
      },
    ],
    words: (v) =>
      `arrive at ${text(v.at)} when ${text(v.to)} is at ${text(v.when_at)}` +
      maybe(v.speed, ", at", "km/h", 3.6) +
      (v.steady === 0 ? "" : maybe(v.steady, " for the last", "m")),
  },
  appear: {
    label: "Appear",
    fields: [
      { is: "pose", name: "at", label: "Appears at" },
      number("speed", "Speed", " km/h", undefined, { max: 360, scale: 3.6 }),
    ],
    words: (v) =>
      `appear${Array.isArray(v.at) ? ` at ${text(v.at.slice(0, 2))}` : ""}${maybe(v.speed, " at", "km/h", 3.6)}`,
  },
  end: { label: "End the run", fields: [], words: () => "end the run" },
  vanish: { label: "Leave the simulation", fields: [], words: () => "leave the simulation" },
  signal: {
    label: "Switch a traffic light",
    fields: [
      light(),
      {
        is: "choice",
        name: "shows",
        label: "To",
        choices: { green: "Green for a movement", off: "Off", program: "Its program" },
      },
      { ...movement(), without: (values) => values.shows === "off" || values.shows === "program" },
    ],
    words: (v) => {
      if (v.shows === "off") return `switch light ${text(v.light)} off`;
      if (v.shows === "program") return `let light ${text(v.light)} run its program again`;
      return `switch light ${text(v.light)} to green for ${text(v.movement)}`;
    },
  },
  lights: {
    label: "Set its lights",
    fields: [
      {
        is: "choice",
        name: "indicator",
        label: "Indicator",
        choices: { off: "Off", left: "Left", right: "Right", hazard: "Hazard lights" },
        optional: true,
      },
      ...Object.entries(LIGHTS).map(([name, word]) => ({
        is: "choice" as const,
        name,
        label: sentence(word),
        choices: { true: "On", false: "Off" },
        optional: true,
      })),
    ],
    words: lightWords,
  },
  horn: { label: "Sound the horn", fields: [], words: () => "sound the horn" },
  ignore: {
    label: "Ignore traffic rules",
    fields: [
      { is: "flag", name: "red", label: "Red lights", otherwise: true },
      { is: "flag", name: "right_of_way", label: "Right of way", otherwise: false },
    ],
    words: ignored,
  },
  release: { label: "Release", fields: [], words: () => "drive as if there had been no rule" },
  own: {
    label: "Of an installed package",
    fields: OWN,
    words: (v) => `do ${text(v.kind)} of an installed package`,
  },
};

export const actionKind = (kind: string): Kind | undefined =>
  (ACTION_KINDS as Partial<Record<string, Kind>>)[kind];
