import { t } from "@lingui/core/macro";

import { speedText } from "../language/units";
import { localized } from "../language/localized";
import { BRAKES, INDICATOR, SIGNAL_COLOR, UNUSABLE } from "../map/colors";
import type { Tint } from "../map/scene";
import { FLAG_BRAKE, FLAG_LEFT, FLAG_RIGHT } from "../map/movingLayer";
import { nth } from "../lists";
import type { Frame } from "./frames";

/** What the colour of a road user says. */
const COLOURS_BY = ["kind", "speed", "delay", "signal", "lamps"] as const;
export type ColourBy = (typeof COLOURS_BY)[number];

export const isColourBy = (word: string | undefined): word is ColourBy =>
  COLOURS_BY.some((one) => one === word);

/** Below this speed one is stopped, as in the figures of a run; m/s. */
export const STOPPED = 0.1;

/** From blue to red, distinct for the colour-blind too (RdYlBu of ColorBrewer). */
const COLD_TO_HOT = ["#4575b4", "#91bfdb", "#fee090", "#fc8d59", "#d73027"] as const;

interface Scale {
  /** What it is called in the list of choices. */
  word: string;
  colors: readonly string[];
  /** What each colour means. */
  legend: readonly string[];
  /** Which colour a row of a frame has. */
  of: (frame: Frame, row: number) => number;
}

/** Speeds at which another colour begins, m/s. */
const SPEEDS = [STOPPED, 20 / 3.6, 40 / 3.6, 60 / 3.6] as const;
/** Stopped delays at which another colour begins, seconds. */
const DELAYS = [1, 10, 30, 60] as const;

const below = (bounds: readonly number[], value: number): number => {
  const found = bounds.findIndex((bound) => value < bound);
  return found < 0 ? bounds.length : found;
};

/** The bounds are round in km/h; in other units they are what they are. */
function speedLegend(): string[] {
  const [, a, b, c] = SPEEDS;
  const [, first, second, third] = [a, a, b, c].map(speedText);
  const from = (speed: number): string => speedText(speed).split(" ")[0] ?? "";
  return [
    t({ message: "Stopped", context: "a vehicle" }),
    t`Below ${first ?? ""}`,
    t`${from(a)} to ${second ?? ""}`,
    t`${from(b)} to ${third ?? ""}`,
    t`${third ?? ""} and more`,
  ];
}

export const SCALES = localized((): Record<Exclude<ColourBy, "kind">, Scale> => ({
  speed: {
    word: t`Speed`,
    colors: [...COLD_TO_HOT].reverse(),
    legend: speedLegend(),
    of: (frame, row) => below(SPEEDS, nth(frame.rows, 6 * row + 4)),
  },
  delay: {
    word: t`Stopped delay`,
    colors: COLD_TO_HOT,
    legend: [t`Not stopped yet`, t`Stopped for 1 to 10 s`, t`10 to 30 s`, t`30 to 60 s`, t`1 min and more`],
    of: (frame, row) => below(DELAYS, frame.stopped?.[row] ?? 0),
  },
  signal: {
    word: t`Light ahead`,
    colors: [UNUSABLE, SIGNAL_COLOR.green, "#a3e635", SIGNAL_COLOR.yellow, SIGNAL_COLOR.red],
    legend: [t`No light ahead`, t`May go`, t`May go, gives way`, t`Yellow`, t`Red`],
    of: (frame, row) => frame.ahead?.[row] ?? 0,
  },
  lamps: {
    word: t`Brakes and indicators`,
    colors: [UNUSABLE, INDICATOR, BRAKES],
    legend: [t`Neither`, t`Indicator`, t`Brakes`],
    of: (frame, row) => {
      const flags = nth(frame.rows, 6 * row + 5);
      return flags & FLAG_BRAKE ? 2 : flags & (FLAG_LEFT | FLAG_RIGHT) ? 1 : 0;
    },
  },
}));

/** Choices of colours; a recording has no lamps, and not all maps have traffic lights. */
export const coloursFor = (live: boolean, lights: boolean): { value: ColourBy; label: string }[] => [
  { value: "kind", label: t`Kind` },
  ...(
    [
      "speed",
      "delay",
      ...(lights ? (["signal"] as const) : []),
      ...(live ? (["lamps"] as const) : []),
    ] as const
  ).map((value) => ({
    value,
    label: SCALES()[value].word,
  })),
];

/** Colours of the rows of a frame that are drawn; nothing where kinds have theirs. */
export function tintOf(by: ColourBy, frame: Frame, drawn: ArrayLike<number>): Tint | null {
  if (by === "kind") return null;
  const { colors, of } = SCALES()[by];
  return { colors, group: Uint8Array.from(drawn, (row) => of(frame, row)) };
}

/** Adds up how long each road user has been stopped since it is seen, for frames as they come. */
export class StoppedDelay {
  private readonly seconds = new Map<number, number>();
  private time = Infinity;

  /** The same frame with the stopped delay of each row, seconds; one that has it stays as it is. */
  learn(frame: Frame): Frame {
    if (frame.stopped) return frame;
    const passed = Math.max(0, frame.time - this.time);
    this.time = frame.time;
    const stopped = new Float32Array(frame.count);
    for (let row = 0; row < frame.count; row++) {
      const who = nth(frame.rows, 6 * row);
      const before = this.seconds.get(who) ?? 0;
      const now = nth(frame.rows, 6 * row + 4) < STOPPED ? before + passed : before;
      if (now > before) this.seconds.set(who, now);
      stopped[row] = now;
    }
    return { ...frame, stopped };
  }
}
