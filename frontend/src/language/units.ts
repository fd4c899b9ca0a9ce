import { fixed, short } from "./numbers";
import { type Preferences, preferences } from "./preferences";

/** What is shown in a unit of the reader's choice; the document has m/s and metres. */
export type Quantity = "speed" | "length";

export interface Unit {
  sign: string;
  /** How many of it are one of the document's. */
  scale: number;
}

/** One km/h in m/s; limits of fields are round in it. */
export const KMH = 1 / 3.6;
const FOOT = 0.3048;
const MILE = 1609.344;
const ACRE = 4046.8564224;
const KILOMETRE = { metres: 1000, sign: "km" };
const ENGLISH_MILE = { metres: MILE, sign: "mi" };

const SPEEDS: Record<Preferences["speed"], number> = { "km/h": 3.6, mph: 3600 / MILE, "m/s": 1 };
const LENGTHS: Record<Preferences["length"], number> = { m: 1, ft: 1 / FOOT };

/** The unit in which a quantity is shown now. */
export function unitFor(quantity: Quantity): Unit {
  const { speed, length } = preferences();
  return quantity === "speed"
    ? { sign: speed, scale: SPEEDS[speed] }
    : { sign: length, scale: LENGTHS[length] };
}

/** The document's number in the unit that is shown. */
export const toShown = (value: number, quantity: Quantity): number => value * unitFor(quantity).scale;

/** Inverse of {@link toShown}. */
export const fromShown = (shown: number, quantity: Quantity): number => shown / unitFor(quantity).scale;

/** How numbers of one unit of the document are shown; only speeds and lengths in another one. */
export interface ShownUnit {
  sign: string;
  shown: (value: number) => number;
  /** Inverse of `shown`. */
  kept: (shown: number) => number;
}

/** The reader's unit of what the document has in `unit`, such as `m/s` or `s`. */
export function shownUnit(unit: string): ShownUnit {
  const quantity: Quantity | null = unit === "m/s" ? "speed" : unit === "m" ? "length" : null;
  const { sign, scale } = quantity ? unitFor(quantity) : { sign: unit, scale: 1 };
  if (scale === 1) return { sign, shown: (value) => value, kept: (shown) => shown };
  // What was typed comes back as it was: 30 km/h are not 30.000000000000004.
  return {
    sign,
    shown: (value) => Number((value * scale).toPrecision(9)),
    kept: (shown) => Number((shown / scale).toPrecision(12)),
  };
}

/** A speed, m/s, in words. */
export function speedText(speed: number): string {
  const { sign, scale } = unitFor("speed");
  return `${fixed(speed * scale, sign === "m/s" ? 1 : 0)} ${sign}`;
}

/** A length, m, in words, with so many digits after the point where it is metres. */
export function lengthText(metres: number, digits = 0): string {
  const { sign, scale } = unitFor("length");
  return `${fixed(metres * scale, digits)} ${sign}`;
}

/** A length of which the order counts: km or miles where it is long. */
export function roughLength(metres: number): string {
  if (unitFor("length").sign === "m") {
    if (metres >= 10_000) return `${fixed(metres / 1000, 0)} km`;
    return metres >= 1000 ? `${short(metres / 1000, 1)} km` : lengthText(metres);
  }
  const miles = metres / MILE;
  if (miles >= 10) return `${fixed(miles, 0)} mi`;
  return miles >= 0.5 ? `${short(miles, 1)} mi` : lengthText(metres);
}

/** Kilometres or miles, of a metre: what the length of roads is counted in. */
export const roadUnit = (): Unit =>
  unitFor("length").sign === "ft" ? { sign: "mi", scale: 1 / MILE } : { sign: "km", scale: 1 / 1000 };

/** The longest round length up to so many metres, for a bar that shows the scale of a map. */
export function roundLength(most: number): { metres: number; text: string } {
  const feet = unitFor("length").sign === "ft";
  const large = feet ? ENGLISH_MILE : KILOMETRE;
  const small = feet ? { metres: FOOT, sign: "ft" } : { metres: 1, sign: "m" };
  const { metres, sign } = most >= large.metres ? large : small;
  const n = below(most / metres);
  return { metres: n * metres, text: `${n} ${sign}` };
}

/** 1, 2 or 5 times a power of ten, at most `n`. */
function below(n: number): number {
  const power = 10 ** Math.floor(Math.log10(n));
  return power * (n >= 5 * power ? 5 : n >= 2 * power ? 2 : 1);
}

/** The shortest round length of at least so many metres, also in the unit in which it is round. */
export function gridStep(least: number): { metres: number; shown: number; unit: string } {
  const { sign, scale } = unitFor("length");
  const wanted = least * scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const step = power * (wanted <= power ? 1 : wanted <= 2 * power ? 2 : wanted <= 5 * power ? 5 : 10);
  return { metres: step / scale, shown: step, unit: sign };
}

/** A length that was measured on a map: to a tenth where that can be seen, in km or miles where it is long. */
export function measuredLength(metres: number): string {
  const { metres: large, sign } = unitFor("length").sign === "m" ? KILOMETRE : ENGLISH_MILE;
  if (metres >= large) return `${fixed(metres / large, 2)} ${sign}`;
  return lengthText(metres, metres < 100 ? 1 : 0);
}

/** An area, m², in words: square metres and square kilometres, or square feet and acres. */
export function areaText(squareMetres: number): string {
  if (unitFor("length").sign === "m") {
    return squareMetres >= 1e6 ? `${fixed(squareMetres / 1e6, 2)} km²` : `${fixed(squareMetres, 0)} m²`;
  }
  const acres = squareMetres / ACRE;
  return acres >= 1 ? `${fixed(acres, 2)} ac` : `${fixed(squareMetres / FOOT ** 2, 0)} ft²`;
}

/** Hours and minutes of a time of the day in seconds: `17:05`, or `5:05 PM`. */
export function dayTime(seconds: number): string {
  const minutes = Math.round(seconds / 60);
  const [hour, minute] = [Math.floor(minutes / 60), String(minutes % 60).padStart(2, "0")];
  if (preferences().hours === 24) return `${String(hour).padStart(2, "0")}:${minute}`;
  const half = hour % 24 < 12 ? "AM" : "PM";
  return `${hour % 12 === 0 ? 12 : hour % 12}:${minute} ${half}`;
}

/** Seconds of a time of the day as it is typed, in 24 or 12 hours; null if it is none. */
export function parsedDayTime(text: string): number | null {
  const [, h, m, half] = /^(\d{1,2}):(\d\d)\s*(?:([ap])\.?m\.?)?$/i.exec(text.trim()) ?? [];
  if (h === undefined || m === undefined || Number(m) > 59) return null;
  const hour = Number(h);
  if (half === undefined) return hour < 24 ? hour * 3600 + Number(m) * 60 : null;
  if (hour < 1 || hour > 12) return null;
  return (hour % 12) * 3600 + (half.toLowerCase() === "p" ? 43_200 : 0) + Number(m) * 60;
}

/**
 * How a field shows a number whose unit is in its suffix: speeds in km/h and lengths in metres in the
 * unit of the reader, all else as it is. `digits` are those to show besides.
 */
export function shownAs(suffix: string): { suffix: string; scale: number; digits: number } {
  const quantity = suffix === " km/h" ? "speed" : suffix === " m" ? "length" : null;
  if (quantity === null) return { suffix, scale: 1, digits: 0 };
  const { sign, scale } = unitFor(quantity);
  return {
    suffix: ` ${sign}`,
    scale: quantity === "speed" ? scale / 3.6 : scale,
    digits: sign === "m/s" ? 1 : 0,
  };
}
