import type { Category, DrivingStyle, MapStatistics, NetworkOrigin, WeatherPreset } from "../api/types";
import { isKey } from "../lists";

/** The same words, as they begin a sentence. */
export const sentence = (words: string): string => words.charAt(0).toUpperCase() + words.slice(1);

/** Words of the page: plain sentences with the terms of traffic engineers; see the help for those. */
export const CATEGORY_WORD: Record<Category, string> = {
  car: "Car",
  van: "Van",
  truck: "Truck",
  bus: "Bus",
  motorcycle: "Motorcycle",
  bicycle: "Bicycle",
  pedestrian: "Pedestrian",
};

const STYLE_WORD: Record<DrivingStyle, string> = {
  cautious: "Cautious",
  normal: "Normal",
  sporty: "Sporty",
};

/** A driving style in words, or the id of a driver set. */
export const styleWord = (style: string): string => (isKey(STYLE_WORD, style) ? STYLE_WORD[style] : style);

/** Choices of a driving style: those that there are always, and the scenario's driver sets. */
export const styleChoices = (sets: readonly string[]): { value: string; label: string }[] =>
  [...Object.keys(STYLE_WORD), ...sets].map((value) => ({ value, label: styleWord(value) }));

/** A flow in words, by whether its road users are on foot. */
export const flowWord = (walks: boolean): string => (walks ? "Pedestrian flow" : "Vehicle flow");

const KIND_WORD: Record<string, string> = {
  clear: "Clear",
  cloudy: "Cloudy",
  wet: "Wet roads",
  rain_light: "Light rain",
  rain_medium: "Rain",
  rain_heavy: "Heavy rain",
  fog: "Fog",
  dust: "Dust",
};
const TIME_WORD = { day: "day", sunset: "sunset", night: "night" } as const;

export const weatherWord = (preset: WeatherPreset): string =>
  `${kindWord(preset.kind)}, ${TIME_WORD[preset.time_of_day]}`;
export const kindWord = (kind: string): string => KIND_WORD[kind] ?? kind.replaceAll("_", " ");

const PARAMETER_WORD: Record<string, string> = {
  cloudiness: "Clouds",
  precipitation: "Rain",
  precipitation_deposits: "Puddles",
  wind_intensity: "Wind",
  sun_azimuth_angle: "Direction of the sun",
  sun_altitude_angle: "Height of the sun",
  fog_density: "Fog",
  fog_distance: "Fog begins after",
  wetness: "Wetness of the road",
  dust_storm: "Dust",
};
/** Parameters that a person can imagine, in this order; the others only matter to a picture. */
export const PARAMETERS = Object.entries(PARAMETER_WORD).map(([name, word]) => ({ name, word }));

export const modelWord = (id: string): string =>
  id
    .replace(/^(vehicle|walker)\.(pedestrian\.)?/, "")
    .replaceAll(/[._]/g, " ")
    .replace(/^0/, "Person 0")
    .replace(/\b\w/g, (c) => c.toUpperCase());

export function length(metres: number): string {
  if (metres >= 10_000) return `${(metres / 1000).toFixed(0)} km`;
  return metres >= 1000 ? `${(metres / 1000).toFixed(1)} km` : `${metres.toFixed(0)} m`;
}

export const kmh = (speed: number): string => `${Math.round(speed * 3.6)} km/h`;

export function clock(seconds: number): string {
  const s = Math.max(0, seconds);
  const minutes = Math.floor(s / 60);
  return `${minutes}:${(s - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}

/** Hours and minutes, for times of which seconds say nothing: `1 h 05 min`. */
export function hoursMinutes(seconds: number): string {
  const minutes = Math.round(Math.max(0, seconds) / 60);
  const [h, min] = [Math.floor(minutes / 60), minutes % 60];
  if (h === 0) return `${min} min`;
  return min === 0 ? `${h} h` : `${h} h ${String(min).padStart(2, "0")} min`;
}

/** Minutes of the hour, or seconds of the minute, in two digits. */
const sixtieth = (n: number): string => String(Math.floor(n) % 60).padStart(2, "0");

/** Hours, minutes and seconds of a long run; the tenths of {@link clock} for a short one. */
export function longClock(seconds: number, longest: number): string {
  if (longest < 3600) return clock(seconds);
  const s = Math.max(0, seconds);
  return `${Math.floor(s / 3600)}:${sixtieth(s / 60)}:${sixtieth(s)}`;
}

/** From when to when after the start, in the unit that fits: `0–15 min`, `0:15–10:00 h`. */
export function span(begin: number, end: number): string {
  if (begin % 60 !== 0 || end % 60 !== 0) {
    const at = (seconds: number): string => `${Math.floor(seconds / 60)}:${sixtieth(seconds)}`;
    return `${at(begin)}–${at(end)} min`;
  }
  if (end <= 3600) return `${begin / 60}–${end / 60} min`;
  const at = (seconds: number): string => `${Math.floor(seconds / 3600)}:${sixtieth(seconds / 60)}`;
  return `${at(begin)}–${at(end)} h`;
}

export function bytes(n: number): string {
  const [size, word] = n >= 1e9 ? [1e9, "GB"] : n >= 1e6 ? [1e6, "MB"] : [1e3, "kB"];
  return `${(n / size).toLocaleString("en", { maximumFractionDigits: n >= 10 * size ? 0 : 1 })} ${word}`;
}

export const count = (n: number, one: string, many = `${one}s`): string =>
  `${n.toLocaleString("en")} ${n === 1 ? one : many}`;

/** Who wrote the network of a map, where it is not odscen itself. */
export function networkFact({ converter, source }: NetworkOrigin): string[] {
  if (converter === "odscen") return [];
  return [converter === "file" ? `network from ${source ?? "a file"}` : "network by netconvert"];
}

export function mapFacts(s: MapStatistics): string[] {
  const [x0, y0, x1, y1] = s.bounds;
  const facts = [
    `${length(x1 - x0)} × ${length(y1 - y0)}`,
    `${length(s.driving_lane_length)} of lanes`,
    count(s.junctions, "junction"),
    count(s.crosswalks, "crosswalk"),
    count(s.traffic_lights, "traffic light"),
  ];
  if (s.stop_signs) facts.push(count(s.stop_signs, "stop sign"));
  if (s.speed_limit_min !== null && s.speed_limit_max !== null) {
    const [low, high] = [kmh(s.speed_limit_min), kmh(s.speed_limit_max)];
    facts.push(low === high ? `limit ${low}` : `limits ${Math.round(s.speed_limit_min * 3.6)}–${high}`);
  }
  if (s.rule === "LHT") facts.push("left-hand traffic");
  return facts;
}
