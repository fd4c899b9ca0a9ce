import type { View } from "../map/view";
import { type Camera, isCamera } from "../scenery/cameras";
import type { Kept } from "../ui/kept";
import { laneSight, type LaneSight, laneSightText } from "./laneUse";
import { type ColourBy, isColourBy } from "./tint";

/** One of the views of a run. */
export interface RunSight {
  /** Stays the same while the view is open. */
  id: number;
  /** The road user that stays in its middle. */
  followed: string | null;
  /** What the colours of its road users say. */
  by: ColourBy;
  /** What the colours of lanes say, once the run has ended; null for nothing. */
  lanes: LaneSight | null;
  /** From where it is looked at in three dimensions; null for the plan. */
  camera: Camera | null;
  /** Where it was opened; null for where the scenario takes place. */
  begin: View | null;
}

/** The views of a run in their order, of which there is always one, and the id of the one used last. */
export interface RunViews {
  list: readonly RunSight[];
  used: number;
}

/** More would be too small to read on most screens. */
export const MOST_VIEWS = 2;

/** The views that a link asks for. */
export function openedViews({ at, chosen, by, lanes, camera, others = [] }: Kept): RunViews {
  const all = [{ at, followed: chosen?.[0], by, lanes, camera }, ...others].slice(0, MOST_VIEWS);
  return {
    list: all.map((one, id) => ({
      id,
      followed: one.followed ?? null,
      by: isColourBy(one.by) ? one.by : "kind",
      lanes: laneSight(one.lanes),
      camera: isCamera(one.camera) ? one.camera : null,
      begin: one.at ?? null,
    })),
    used: 0,
  };
}

/** What a link keeps of views; `places` has by id where they are now. */
export function keptOf({ list }: RunViews, places: ReadonlyMap<number, View>): Kept {
  const [first, ...others] = list.map(({ id, followed, by, lanes, camera, begin }) => {
    const at = places.get(id) ?? begin;
    return {
      ...(at && { at }),
      ...(followed && { followed }),
      ...(by !== "kind" && { by }),
      ...(lanes && { lanes: laneSightText(lanes) }),
      ...(camera && { camera }),
    };
  });
  // What is not there takes away what the address has, but for a place that is not known yet.
  return {
    ...(first?.at && { at: first.at }),
    chosen: first?.followed ? [first.followed] : [],
    by: first?.by,
    lanes: first?.lanes,
    camera: first?.camera,
    others,
  };
}

/** One view more, right after the one with this id: it has its colours and shows the same part of the map. */
export function added(views: RunViews, after: number, at: View | null): RunViews {
  const { list } = views;
  const index = list.findIndex(({ id }) => id === after);
  const model = list[index];
  if (!model || list.length >= MOST_VIEWS) return views;
  const id = Math.max(...list.map((one) => one.id)) + 1;
  // Without a road user there is no seat to look from.
  const camera = model.camera === "above" ? model.camera : null;
  const made = { ...model, id, followed: null, camera, begin: at ?? model.begin };
  return { list: list.toSpliced(index + 1, 0, made), used: id };
}

/** Without one view; the last one stays. */
export function closed(views: RunViews, id: number): RunViews {
  const list = views.list.filter((one) => one.id !== id);
  const [first] = list;
  if (!first) return views;
  return { list, used: views.used === id ? first.id : views.used };
}

/** With something else in one view. */
export const changed = (
  { list, used }: RunViews,
  id: number,
  part: Partial<Pick<RunSight, "followed" | "by" | "lanes" | "camera">>,
): RunViews => ({ list: list.map((one) => (one.id === id ? { ...one, ...part } : one)), used });
