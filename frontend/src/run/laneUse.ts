import { t } from "@lingui/core/macro";

import type { RunLanes } from "../api/runs";
import { localized } from "../language/localized";
import { short } from "../language/numbers";
import { roadUnit, unitFor } from "../language/units";
import { nth } from "../lists";
import { ticks } from "./scale";

export const LANES_BY = ["speed", "delay", "density", "flow"] as const;
/** What the colour of a lane says. */
export type LanesBy = (typeof LANES_BY)[number];

/** What a view shows of lanes: over the intervals from the first up to before the last, or the whole run. */
export interface LaneSight {
  by: LanesBy;
  span: readonly [number, number] | null;
}

/** As a link has it: `delay`, or `delay,2,5`; null if that is nothing that can be shown. */
export function laneSight(text = ""): LaneSight | null {
  const [word, ...span] = text.split(",");
  const by = LANES_BY.find((one) => one === word);
  if (!by) return null;
  const [from = NaN, to = NaN] = span.map(Number);
  const some = [from, to].every(Number.isInteger) && from >= 0 && from < to;
  return { by, span: some ? [from, to] : null };
}

/** Inverse of {@link laneSight}. */
export const laneSightText = ({ by, span }: LaneSight): string => [by, ...(span ?? [])].join(",");

/**
 * From dark to light, distinct for the colour-blind too: viridis of Matplotlib at equal distances, without
 * its darkest ninth, which the dark map would swallow.
 */
const VIRIDIS = [
  ...["#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6dcd59", "#b4de2c"],
  "#fde725",
] as const;
/** More would look alike. */
const MOST_COLORS = 6;
/** Share of lanes below the last bound: one that is far off must not make all others alike. */
const USUAL = 0.95;

/** Of all vehicles on a lane: metres that they drove, seconds that they spent and lost. */
interface Sums {
  distance: number;
  seconds: number;
  lost: number;
  /** Of the lane, metres. */
  length: number;
  /** Seconds that all this took. */
  time: number;
}

interface Quantity {
  word: string;
  sign: () => string;
  /** In the unit of the reader, by Edie's definitions. */
  of: (sums: Sums) => number;
}

export const QUANTITIES = localized((): Record<LanesBy, Quantity> => ({
  speed: {
    word: t`Speed`,
    sign: () => unitFor("speed").sign,
    of: ({ distance, seconds }) => (distance / seconds) * unitFor("speed").scale,
  },
  delay: {
    word: roadUnit().sign === "km" ? t`Delay per km` : t`Delay per mile`,
    sign: () => `s/${roadUnit().sign}`,
    // Where all vehicles were stopped, no number is large enough.
    of: ({ distance, lost }) => (distance > 0 ? lost / (distance * roadUnit().scale) : Infinity),
  },
  density: {
    word: t`Density`,
    sign: () => t`veh/${roadUnit().sign}`,
    of: ({ seconds, length, time }) => seconds / time / (length * roadUnit().scale),
  },
  flow: {
    word: t({ message: "Flow", context: "vehicles per hour" }),
    sign: () => t`veh/h`,
    of: ({ distance, length, time }) => (3600 * distance) / (length * time),
  },
}));

/** How the lanes of a map were used in a run, over any of its intervals. */
export class LaneUse {
  private readonly rowOfNode = new Map<number, number>();

  constructor(readonly columns: RunLanes) {
    columns.node_first.forEach((first, k) => {
      for (let i = first; i < nth(columns.node_end, k); i++) this.rowOfNode.set(i, nth(columns.node_lane, k));
    });
  }

  /** Number of intervals. */
  get intervals(): number {
    return this.columns.times.length - 1;
  }

  /** Row of the lane that a node of the graph lies on; null if no vehicle was ever there. */
  rowOf(node: number): number | null {
    return this.rowOfNode.get(node) ?? null;
  }

  /** A value for each lane over intervals `from` up to `to`, in the reader's unit; NaN without vehicles. */
  values(by: LanesBy, from = 0, to = this.intervals): Float64Array {
    const { first, lane, distance, seconds, time_loss, lengths, times } = this.columns;
    const sums = lengths.map((length) => ({ distance: 0, seconds: 0, lost: 0, length }));
    for (let k = nth(first, from); k < nth(first, to); k++) {
      const sum = nth(sums, nth(lane, k));
      sum.distance += nth(distance, k);
      sum.seconds += nth(seconds, k);
      sum.lost += nth(time_loss, k);
    }
    const { of } = QUANTITIES()[by];
    const time = nth(times, to) - nth(times, from);
    return Float64Array.from(sums, (sum) => (sum.seconds > 0 ? of({ ...sum, time }) : NaN));
  }
}

/** Round bounds between the colours, the same for every part of the run. */
export function boundsOf(values: Float64Array): number[] {
  const known = values.filter(Number.isFinite).sort();
  return ticks(known[Math.floor(USUAL * (known.length - 1))] ?? 0, MOST_COLORS).slice(1, -1);
}

/** Which colour a value has; null without a value. */
export function classOf(bounds: readonly number[], value: number): number | null {
  if (Number.isNaN(value)) return null;
  const found = bounds.findIndex((bound) => value < bound);
  return found < 0 ? bounds.length : found;
}

/** So many colours from one end of the scale to the other. */
export function sequential(count: number): string[] {
  const channels = (hex: string): number[] => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  return Array.from({ length: count }, (_, n) => {
    const at = count > 1 ? (n * (VIRIDIS.length - 1)) / (count - 1) : 0;
    const low = Math.floor(at);
    const [a, b] = [nth(VIRIDIS, low), nth(VIRIDIS, Math.min(low + 1, VIRIDIS.length - 1))].map(channels);
    const mixed = (a ?? []).map((value, k) => Math.round(value + (at - low) * (nth(b ?? [], k) - value)));
    return `#${mixed.map((value) => value.toString(16).padStart(2, "0")).join("")}`;
  });
}

/** What each colour means. */
export function wordsOf(by: LanesBy, bounds: readonly number[]): string[] {
  const sign = QUANTITIES()[by].sign();
  const text = bounds.map((bound) => short(bound, 4));
  const [least, most] = [text[0], text.at(-1)];
  if (least === undefined || most === undefined) return [sign];
  return [
    t`Below ${`${least} ${sign}`}`,
    ...text.slice(1).map((high, k) => t`${nth(text, k)} to ${`${high} ${sign}`}`),
    t`${`${most} ${sign}`} and more`,
  ];
}

/** A value in words. */
export function valueText(by: LanesBy, value: number): string {
  if (Number.isNaN(value)) return t`no vehicle`;
  if (value === Infinity) return t`vehicles were stopped all the time`;
  return `${short(value, value < 100 ? 1 : 0)} ${QUANTITIES()[by].sign()}`;
}
