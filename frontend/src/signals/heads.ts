import type { MapDetails } from "../api/types";
import { nth } from "../lists";

/** What a signal shows, each drawn in a shape of its own. */
export type Shown = "red" | "yellow" | "green" | "permissive" | "off";

/** A signal at its stop line, or at one end of a crossing; metres, radians. */
export interface Head {
  x: number;
  y: number;
  hdg: number;
  walk: boolean;
  shown: Shown;
}

/** Where a light has a head, and the letters of its state that are shown there. */
interface Place extends Omit<Head, "shown"> {
  letters: number[];
}

const OF_LETTER: Record<string, Shown> = {
  G: "green",
  g: "permissive",
  s: "permissive",
  y: "yellow",
  Y: "yellow",
  u: "yellow",
  r: "red",
  R: "red",
};
/** What a letter of SUMO's states shows. */
export const shownOf = (letter: string): Shown => OF_LETTER[letter] ?? "off";
const RANK: readonly Shown[] = ["green", "permissive", "yellow", "red", "off"];

/** The heads of all lights of a map; made once. */
export class Heads {
  private readonly places: readonly { light: string; junction: string; places: readonly Place[] }[];

  constructor(lights: MapDetails["lights"]) {
    this.places = lights.map((light) => ({
      light: light.id,
      junction: light.names[0] ?? light.id,
      places: placesOf(light),
    }));
  }

  /** What is shown at each head, of the lights whose state is known. */
  at(stateOf: (light: string) => string | undefined): Head[] {
    return this.places.flatMap(({ light, places }) => {
      const state = stateOf(light);
      if (state === undefined) return [];
      return places.map(({ letters, ...place }) => ({ ...place, shown: mostOf(letters, state) }));
    });
  }

  /** The junction whose light has a head within `reach` metres. */
  junctionAt({ x, y, reach }: { x: number; y: number; reach: number }): string | null {
    let best: string | null = null;
    let least = Math.max(reach, 3);
    for (const { junction, places } of this.places)
      for (const place of places) {
        const away = Math.hypot(place.x - x, place.y - y);
        if (away < least) [best, least] = [junction, away];
      }
    return best;
  }

  /** The middle of the light of a junction. */
  middle(junction: string): { x: number; y: number } | null {
    const places = this.places.find((one) => one.junction === junction)?.places ?? [];
    if (places.length === 0) return null;
    const mean = (of: (one: Place) => number): number =>
      places.reduce((sum, one) => sum + of(one), 0) / places.length;
    return { x: mean(({ x }) => x), y: mean(({ y }) => y) };
  }

  get junctions(): string[] {
    return this.places.map(({ junction }) => junction);
  }
}

/** What letters of a state show together: of several movements the one that may go most. */
export function mostOf(letters: readonly number[], state: string): Shown {
  const shown = letters.map((n) => shownOf(state[n] ?? ""));
  return RANK.find((one) => shown.includes(one)) ?? "off";
}

function placesOf({ paths, walks }: MapDetails["lights"][number]): Place[] {
  const found = new Map<string, Place>();
  const add = (n: number, [x, y]: [number, number], [tx, ty]: [number, number], walk: boolean): void => {
    const key = `${x.toFixed(1)} ${y.toFixed(1)} ${walk}`;
    const place = found.get(key);
    if (place) place.letters.push(n);
    else found.set(key, { x, y, hdg: Math.atan2(ty - y, tx - x), walk, letters: [n] });
  };
  paths.forEach((path, n) => {
    if (path.length < 2) return;
    const walk = walks[n] === true;
    add(n, nth(path, 0), nth(path, 1), walk);
    if (walk) add(n, nth(path, path.length - 1), nth(path, path.length - 2), walk);
  });
  return [...found.values()];
}
