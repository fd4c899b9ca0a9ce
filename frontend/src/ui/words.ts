import { i18n } from "@lingui/core";
import { plural, t } from "@lingui/core/macro";

import { speedText, roughLength } from "../language/units";
import { localized } from "../language/localized";
import type { Category, DrivingStyle, MapStatistics, NetworkOrigin, WeatherPreset } from "../api/types";
import { isKey } from "../lists";

/** The same words, as they begin a sentence. */
export const sentence = (words: string): string => words.charAt(0).toUpperCase() + words.slice(1);

/** A word as it is written within a sentence; German writes nouns with a capital there, too. */
export const inSentence = (word: string): string => (i18n.locale === "de" ? word : word.toLowerCase());

/** Words of the page: plain sentences with the terms of traffic engineers; see the help for those. */
export const CATEGORY_WORD = localized((): Record<Category, string> => ({
  car: t`Car`,
  van: t`Van`,
  truck: t`Truck`,
  bus: t`Bus`,
  motorcycle: t`Motorcycle`,
  bicycle: t`Bicycle`,
  pedestrian: t`Pedestrian`,
}));

const STYLE_WORD = localized((): Record<DrivingStyle, string> => ({
  cautious: t`Cautious`,
  normal: t`Normal`,
  sporty: t`Sporty`,
}));

/** A driving style in words, or the id of a driver set. */
export const styleWord = (style: string): string =>
  isKey(STYLE_WORD(), style) ? STYLE_WORD()[style] : style;

/** Choices of a driving style: those that there are always, and the scenario's driver sets. */
export const styleChoices = (sets: readonly string[]): { value: string; label: string }[] =>
  [...Object.keys(STYLE_WORD()), ...sets].map((value) => ({ value, label: styleWord(value) }));

/** Whether the results of a run are valid, by the level of its verdict. */
const VERDICT_WORD = localized(() => ({
  usable: t`results valid`,
  "usable with reservations": t`results valid with reservations`,
  "not usable": t`results not valid`,
}));
export const verdictWord = (level: string): string =>
  isKey(VERDICT_WORD(), level) ? VERDICT_WORD()[level] : level;

/** Who drives a vehicle that no rule moves. */
export const DRIVERS = localized(() => ({ sumo: t`SUMO's drivers`, story: t`The story alone` }));

/** A flow in words, by whether its road users are on foot. */
export const flowWord = (walks: boolean): string => (walks ? t`Pedestrian flow` : t`Vehicle flow`);

const KIND_WORD = localized((): Record<string, string> => ({
  clear: t`Clear`,
  cloudy: t`Cloudy`,
  wet: t`Wet roads`,
  rain_light: t`Light rain`,
  rain_medium: t`Rain`,
  rain_heavy: t`Heavy rain`,
  fog: t`Fog`,
  dust: t`Dust`,
}));
const TIME_WORD = localized(() => ({ day: t`day`, sunset: t`sunset`, night: t`night` }));

export const weatherWord = (preset: WeatherPreset): string =>
  `${kindWord(preset.kind)}, ${TIME_WORD()[preset.time_of_day]}`;
export const kindWord = (kind: string): string => KIND_WORD()[kind] ?? kind.replaceAll("_", " ");

const PARAMETER_WORD = localized((): Record<string, string> => ({
  cloudiness: t`Clouds`,
  precipitation: t`Rain`,
  precipitation_deposits: t`Puddles`,
  wind_intensity: t`Wind`,
  sun_azimuth_angle: t`Direction of the sun`,
  sun_altitude_angle: t`Height of the sun`,
  fog_density: t`Fog`,
  fog_distance: t`Fog begins after`,
  wetness: t`Wetness of the road`,
  dust_storm: t`Dust`,
}));
/** Parameters that a person can imagine, in this order; the others only matter to a picture. */
export const PARAMETERS = localized(() =>
  Object.entries(PARAMETER_WORD()).map(([name, word]) => ({ name, word })),
);

export const modelWord = (id: string): string =>
  id
    .replace(/^(vehicle|walker)\.(pedestrian\.)?/, "")
    .replaceAll(/[._]/g, " ")
    .replace(/^0/, "Person 0")
    .replace(/\b\w/g, (c) => c.toUpperCase());

/** Hours and minutes, for times of which seconds say nothing: `1 h 05 min`. */
export function hoursMinutes(seconds: number): string {
  const minutes = Math.round(Math.max(0, seconds) / 60);
  const [h, min] = [Math.floor(minutes / 60), minutes % 60];
  if (h === 0) return t`${min} min`;
  return min === 0 ? t`${h} h` : t`${h} h ${String(min).padStart(2, "0")} min`;
}

export function bytes(n: number): string {
  const [size, word] = n >= 1e9 ? [1e9, "GB"] : n >= 1e6 ? [1e6, "MB"] : [1e3, "kB"];
  return `${(n / size).toLocaleString(i18n.locale, { maximumFractionDigits: n >= 10 * size ? 0 : 1 })} ${word}`;
}

const COUNT: Record<Category, (n: number) => string> = {
  car: (n) => plural(n, { one: "# car", other: "# cars" }),
  van: (n) => plural(n, { one: "# van", other: "# vans" }),
  truck: (n) => plural(n, { one: "# truck", other: "# trucks" }),
  bus: (n) => plural(n, { one: "# bus", other: "# buses" }),
  motorcycle: (n) => plural(n, { one: "# motorcycle", other: "# motorcycles" }),
  bicycle: (n) => plural(n, { one: "# bicycle", other: "# bicycles" }),
  pedestrian: (n) => plural(n, { one: "# pedestrian", other: "# pedestrians" }),
};

/** So many of a category. */
export const countOf = (category: Category, n: number): string => COUNT[category](n);

/** Who wrote the network of a map, where it is not odscen itself. */
export function networkFact({ converter, source }: NetworkOrigin): string[] {
  if (converter === "odscen") return [];
  return [converter === "file" ? t`network from ${source ?? t`a file`}` : t`network by netconvert`];
}

export function mapFacts(s: MapStatistics): string[] {
  const [x0, y0, x1, y1] = s.bounds;
  const facts = [
    `${roughLength(x1 - x0)} × ${roughLength(y1 - y0)}`,
    t`${roughLength(s.driving_lane_length)} of lanes`,
    plural(s.junctions, { one: "# junction", other: "# junctions" }),
    plural(s.crosswalks, { one: "# crosswalk", other: "# crosswalks" }),
    plural(s.traffic_lights, { one: "# traffic light", other: "# traffic lights" }),
  ];
  if (s.stop_signs) facts.push(plural(s.stop_signs, { one: "# stop sign", other: "# stop signs" }));
  if (s.speed_limit_min !== null && s.speed_limit_max !== null) {
    const [low, high] = [speedText(s.speed_limit_min), speedText(s.speed_limit_max)];
    facts.push(low === high ? t`limit ${low}` : t`limits ${low.split(" ")[0] ?? low}–${high}`);
  }
  if (s.rule === "LHT") facts.push(t`left-hand traffic`);
  return facts;
}
