import { t } from "@lingui/core/macro";

import type { Actor, Flow, ScenarioDocument } from "../api/types";
import { nth } from "../lists";
import type { Graph, Place } from "../map/graph";
import type { Picker } from "../map/picking";

/** Where each of several goes: its id and its new start. */
export type Moves = readonly (readonly [id: string, spawn: string])[];

export const isFlow = (one: Actor | Flow): one is Flow => "per_hour" in one;
/** The places that a route leads through before its goal; those of flows lead through none. */
export const viasOf = (one: Actor | Flow): readonly string[] => (isFlow(one) ? [] : one.via);
/** Where a route begins, the places that it leads through, and its goal if that is chosen. */
export const stationsOf = (one: Actor | Flow): string[] => [
  one.spawn,
  ...viasOf(one),
  ...(one.goal === null ? [] : [one.goal]),
];
/** Those of a document who start somewhere. */
export type Placed = Pick<ScenarioDocument, "actors" | "flows">;
export const everyone = ({ actors, flows }: Placed): (Actor | Flow)[] => [...actors, ...flows];

/** How far from a click a start may be found, metres, when the map is zoomed in. */
const SNAP = 12;

/** The places of a region that are offered as starts: those that are usable and free. */
export class Starts {
  private readonly taken: ReadonlySet<string>;

  constructor(
    private readonly graph: Graph,
    private readonly picker: Picker,
    private readonly inside: ReadonlySet<number>,
    placed: Placed,
  ) {
    this.taken = new Set(everyone(placed).map((one) => one.spawn));
  }

  private free(index: number, walk: boolean, besides?: ReadonlySet<string>): boolean {
    if (!this.graph.usable(index, walk)) return false;
    const { id } = walk ? this.graph.walkPlace(index) : this.graph.vehiclePlace(index);
    return !this.taken.has(id) && !besides?.has(id);
  }

  /** The free start nearest to a point; `reach` in metres is that of the pointer. */
  near(x: number, y: number, reach: number, walk: boolean, besides?: ReadonlySet<string>): Place | null {
    return this.picker.place(x, y, Math.max(3 * reach, SNAP), {
      vehicles: !walk,
      walks: walk,
      inside: this.inside,
      allowed: (i, onFoot) => this.free(i, onFoot, besides),
    });
  }

  /** The point of the region nearest to one on the map, whether free or not, but for one of them. */
  anyNear(x: number, y: number, reach: number, walk: boolean, besides: string): Place | null {
    return this.picker.place(x, y, Math.max(3 * reach, SNAP), {
      vehicles: !walk,
      walks: walk,
      inside: this.inside,
      allowed: (i, onFoot) => this.at(i, onFoot).id !== besides,
    });
  }

  /** Why there is no start at a point, in words. */
  reasonAt(x: number, y: number, reach: number, walk: boolean, who: string): string {
    const wide = Math.max(3 * reach, SNAP);
    const options = { vehicles: !walk, walks: walk };
    const allowed = (i: number, onFoot: boolean): boolean => this.graph.usable(i, onFoot);
    if (this.picker.place(x, y, wide, { ...options, inside: this.inside, allowed }))
      return t`Every point here is occupied. Start the ${who} a little further away.`;
    if (this.picker.place(x, y, wide, { ...options, inside: this.inside }))
      return t`No ${who} may start here: the grey points cannot be used.`;
    if (this.picker.place(x, y, wide, options))
      return t`That is outside the region. Start the ${who} inside it, or extend the region.`;
    const where = walk
      ? t`Pedestrians start on the yellow points beside the road.`
      : t`Vehicles start on the blue points of the lanes.`;
    return t`No ${who} may start here. ${where}`;
  }

  /** The first free start, in the order of the map; far enough from others. */
  first(walk: boolean, others: readonly Place[]): Place | null {
    let fallback: Place | null = null;
    for (const place of this.all(walk)) {
      fallback ??= place;
      if (others.every((other) => Math.hypot(other.x - place.x, other.y - place.y) > SNAP)) return place;
    }
    return fallback;
  }

  /** The next free start along the lane, forwards or back. */
  along(from: Place, step: 1 | -1): Place | null {
    const [first, end] = this.graph.lanePlaces(from);
    const segment = (from.walk ? this.graph.columns.walks : this.graph.columns).segment;
    for (let i = from.index + step; i >= first && i < end; i += step) {
      if (!this.inside.has(nth(segment, i))) return null;
      if (this.free(i, from.walk)) return this.at(i, from.walk);
    }
    return null;
  }

  /** A free start on the next lane of the region; after the last comes the first. */
  otherLane(from: Place): Place | null {
    const [, end] = this.graph.lanePlaces(from);
    const lane = (from.walk ? this.graph.columns.walks : this.graph.columns).lane;
    let wrapped: Place | null = null;
    for (const place of this.all(from.walk)) {
      if (lane[place.index] === lane[from.index]) continue;
      if (place.index >= end) return place;
      wrapped ??= place;
    }
    return wrapped;
  }

  /** The free start on the lane of `from` that is nearest to a point, or `from` itself if that is as near. */
  onLane(from: Place, x: number, y: number, besides: ReadonlySet<string>): Place {
    const [first, end] = this.graph.lanePlaces(from);
    const { segment } = from.walk ? this.graph.columns.walks : this.graph.columns;
    const away = (place: Place): number => Math.hypot(place.x - x, place.y - y);
    let best = from;
    for (let i = first; i < end; i++) {
      if (!this.inside.has(nth(segment, i)) || !this.free(i, from.walk, besides)) continue;
      const place = this.at(i, from.walk);
      if (away(place) < away(best)) best = place;
    }
    return best;
  }

  /**
   * Where several go when the first of them goes to `to`: they keep their distances, each on the
   * free start nearest to where that is; those that find none are left out.
   */
  shifted(ones: readonly (Actor | Flow)[], to: Place): Moves {
    const lead = this.graph.place(ones[0]?.spawn ?? "");
    if (!lead) return [];
    const used = new Set<string>();
    return ones.flatMap((one, n) => {
      const old = this.graph.place(one.spawn);
      if (!old) return [];
      const place =
        n === 0 && old.walk === to.walk
          ? to
          : this.near(old.x + to.x - lead.x, old.y + to.y - lead.y, 0, old.walk, used);
      if (!place || used.has(place.id)) return [];
      used.add(place.id);
      return [[one.id, place.id] as const];
    });
  }

  private at(index: number, walk: boolean): Place {
    return walk ? this.graph.walkPlace(index) : this.graph.vehiclePlace(index);
  }

  private *all(walk: boolean): Generator<Place> {
    const { segment } = walk ? this.graph.columns.walks : this.graph.columns;
    for (let i = 0; i < segment.length; i++) {
      if (this.inside.has(nth(segment, i)) && this.free(i, walk)) yield this.at(i, walk);
    }
  }
}
