import { Color } from "three";

/** What the sky does to a scene: colours, light and how far one sees. */
export interface Sky {
  /** Of sky, fog and the horizon. */
  color: Color;
  /** Density of the fog: 63 % of what is seen at 1 / density metres is fog. */
  fog: number;
  /** Light from everywhere and from the sun, 0 to about 3. */
  ambient: number;
  sun: number;
  sunColor: Color;
  /** Towards the sun. */
  towards: readonly [number, number, number];
  /** Whether lamps of vehicles and streets are on. */
  dark: boolean;
  /** Rain, and water on the road, 0 to 1. */
  rain: number;
  wet: number;
}

const DAY = new Color(0x9cc4e6);
const DUSK = new Color(0xe6a878);
const NIGHT = new Color(0x0b1220);
const GREY = new Color(0xaab2ba);
const DUST = new Color(0xc9a877);
/** Degrees of the sun above the horizon from which on it is day, and below which it is night. */
const [HIGH, LOW] = [20, -6];
/** Percent of fog that takes all sight, as CARLA has it, is this dense, 1/m. */
const THICK = 0.03;

/** The sky of weather parameters, which have CARLA's names and units; a clear noon of none. */
export function skyOf(values: Readonly<Record<string, number>>): Sky {
  const share = (name: string): number => Math.min(Math.max((values[name] ?? 0) / 100, 0), 1);
  const altitude = values.sun_altitude_angle ?? 60;
  const azimuth = ((values.sun_azimuth_angle ?? 225) * Math.PI) / 180;
  const day = Math.min(Math.max((altitude - LOW) / (HIGH - LOW), 0), 1);
  const low = Math.max(0, 1 - Math.abs(altitude - 4) / 16);
  const [cloud, dust, rain] = [share("cloudiness"), share("dust_storm"), share("precipitation")];
  const grey = GREY.clone().multiplyScalar(1 - 0.4 * rain);
  const light = DAY.clone()
    .lerp(grey, Math.max(cloud, rain) * 0.9)
    .lerp(DUSK, low * (1 - cloud) * 0.7);
  const color = NIGHT.clone()
    .lerp(light, day)
    .lerp(DUST, dust * 0.8 * day);
  // Night presets of CARLA have fog that no eye sees.
  const fog = share("fog_density") * (day > 0 ? 1 : 0.2);
  const up = Math.max((altitude * Math.PI) / 180, 0.15);
  return {
    color,
    fog: 0.0006 + THICK * fog ** 2 + 0.012 * dust + 0.004 * rain,
    ambient: 0.25 + 1.35 * day,
    sun: day * (1 - 0.85 * Math.max(cloud, rain)) * 2,
    sunColor: new Color(0xffffff).lerp(DUSK, low),
    // CARLA counts from north, clockwise; here x is east and y is north.
    towards: [Math.sin(azimuth) * Math.cos(up), Math.cos(azimuth) * Math.cos(up), Math.sin(up)],
    dark: day < 0.35,
    rain,
    wet: Math.max(share("wetness"), share("precipitation_deposits")),
  };
}
