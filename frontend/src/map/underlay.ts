import { useEffect } from "react";
import { create } from "zustand";

import { background, backgroundPicture } from "../api/maps";
import type { components } from "../api/schema";

/** A picture that lies under a map, ready to be drawn. */
export interface Underlay {
  source: string;
  image: HTMLImageElement;
  width: number;
  height: number;
  /** `a` to `f` of `x = a column + b row + c`, `y = d column + e row + f`, metres. */
  affine: readonly number[];
}

interface Underlays {
  /** By map; null where it has none. */
  found: Readonly<Record<string, Underlay | null>>;
  /** How much the roads hide of the picture, 0 to 1. */
  roads: number;
}

const KEY = "odscen.roads";
const FIRST = 0.6;

function remembered(): number {
  try {
    const kept = Number.parseFloat(localStorage.getItem(KEY) ?? "");
    return kept >= 0 && kept <= 1 ? kept : FIRST;
  } catch {
    return FIRST;
  }
}

export const useUnderlays = create<Underlays>(() => ({ found: {}, roads: remembered() }));

/** Lets more or less of the picture be seen through the roads, on all maps. */
export function showRoads(roads: number): void {
  useUnderlays.setState({ roads });
  try {
    localStorage.setItem(KEY, String(roads));
  } catch {
    // It holds until the page is closed.
  }
}

/** Draws what the server has under a map, from now on. */
export async function takeUnderlay(
  map: string,
  info: components["schemas"]["BackgroundInfo"] | null,
): Promise<void> {
  let found: Underlay | null = null;
  if (info) {
    const image = new Image();
    image.src = `${backgroundPicture(map)}?v=${info.version}`;
    await image.decode();
    const { source, width, height, affine } = info;
    found = { source, image, width, height, affine };
  }
  useUnderlays.setState((now) => ({ found: { ...now.found, [map]: found } }));
}

/** The picture under a map; null while it is not loaded, or where there is none. */
export function useUnderlay(map: string | undefined): Underlay | null {
  const found = useUnderlays((all) => (map === undefined ? null : all.found[map]));
  useEffect(() => {
    if (map === undefined || found !== undefined) return;
    // A map is whole without its picture.
    background(map)
      .then((info) => takeUnderlay(map, info))
      .catch(() => undefined);
  }, [map, found]);
  return found ?? null;
}
