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
/** How far what is copied or moved along may be put from where it belongs, in turn, metres. */
const FURTHER = [SNAP, 50, 250, 1e5];
/** Room between two bodies, metres. */
const ROOM = 0.5;

/** The ground that a vehicle takes up: the middle, its heading, its length and width, m and rad. */
export interface Body {
  x: number;
  y: number;
  hdg: number;
  length: number;
  width: number;
}

/** Whether two bodies are nearer to each other than the room between them; along and across both. */
export function overlap(a: Body, b: Body): boolean {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const reach = (Math.hypot(a.length, a.width) + Math.hypot(b.length, b.width)) / 2 + ROOM;
  if (Math.abs(dx) > reach || Math.abs(dy) > reach) return false;
  const axes = [a.hdg, a.hdg + Math.PI / 2, b.hdg, b.hdg + Math.PI / 2];
  return axes.every((axis) => {
    const [c, s] = [Math.cos(axis), Math.sin(axis)];
    const half = ({ hdg, length, width }: Body): number =>
      (Math.abs(Math.cos(hdg - axis)) * length + Math.abs(Math.sin(hdg - axis)) * width) / 2;
    return Math.abs(dx * c + dy * s) < half(a) + half(b) + ROOM;
  });
}

/** Length and width, metres. */
export type BodySize = readonly [length: number, width: number];

/** What a start has to be besides free. */
interface Fit {
  /** Nodes that are taken as well. */
  besides?: ReadonlySet<string>;
  size?: BodySize | null;
  /** Bodies that are beside it as well, and ids of those that will not be. */
  others?: readonly Body[];
  without?: ReadonlySet<string>;
}

const NO_ACTORS: ReadonlySet<string> = new Set<string>();
/** No vehicle is longer, metres. */
const LONGEST = 20;

const bodyAt = ({ x, y, hdg }: Place, [length, width]: BodySize): Body => ({ x, y, hdg, length, width });

/** The places of a region that are offered as starts: those that are usable and free. */
export class Starts {
  private readonly taken: ReadonlySet<string>;

  constructor(
    private readonly graph: Graph,
    private readonly picker: Picker,
    private readonly inside: ReadonlySet<number>,
    placed: Placed,
    /** Of the vehicles that are placed, by their ids; none are known without. */
    private readonly bodies: ReadonlyMap<string, Body> = new Map<string, Body>(),
  ) {
    this.taken = new Set(everyone(placed).map((one) => one.spawn));
  }

  private free(index: number, walk: boolean, besides?: ReadonlySet<string>): boolean {
    if (!this.graph.usable(index, walk)) return false;
    const { id } = walk ? this.graph.walkPlace(index) : this.graph.vehiclePlace(index);
    return !this.taken.has(id) && !besides?.has(id);
  }

  /**
   * The free start nearest to a point; `reach` in metres is that of the pointer. One with a size finds
   * one where its body has room, also beside those that move along.
   */
  near(
    x: number,
    y: number,
    reach: number,
    walk: boolean,
    { besides, size, others = [], without = NO_ACTORS }: Fit = {},
  ): Place | null {
    const wide = Math.max(3 * reach, SNAP);
    const beside = size ? [...this.bodiesNear(x, y, wide + LONGEST, without), ...others] : [];
    return this.picker.place(x, y, wide, {
      vehicles: !walk,
      walks: walk,
      inside: this.inside,
      allowed: (i, onFoot) => {
        if (!this.free(i, onFoot, besides)) return false;
        if (!size || beside.length === 0) return true;
        const body = bodyAt(this.at(i, onFoot), size);
        return beside.every((other) => !overlap(body, other));
      },
    });
  }

  private bodiesNear(x: number, y: number, reach: number, without: ReadonlySet<string>): Body[] {
    const found: Body[] = [];
    for (const [id, body] of this.bodies)
      if (!without.has(id) && Math.abs(body.x - x) < reach && Math.abs(body.y - y) < reach) found.push(body);
    return found;
  }

  /** How far a place is from the one that a click means, whether that is free or not, metres. */
  beyond(x: number, y: number, reach: number, { walk, id, x: px, y: py }: Place): number {
    const meant = this.picker.place(x, y, Math.max(3 * reach, SNAP), {
      vehicles: !walk,
      walks: walk,
      inside: this.inside,
      allowed: (i, onFoot) => this.graph.usable(i, onFoot),
    });
    return !meant || meant.id === id ? 0 : Math.hypot(meant.x - px, meant.y - py);
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
      return t`Every place here is occupied. Start the ${who} a little further away.`;
    if (this.picker.place(x, y, wide, { ...options, inside: this.inside }))
      return t`No ${who} may start on this lane.`;
    if (this.picker.place(x, y, wide, options))
      return t`That is outside the region. Start the ${who} inside it, or extend the region.`;
    const where = walk ? t`Pedestrians start on sidewalks and crosswalks.` : t`Vehicles start on lanes.`;
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
   * free start nearest to where that is and where its body has room, be it further away; those that
   * find none in the whole region are left out. Those that `move` leave room where they were.
   */
  shifted(ones: readonly (Actor | Flow)[], to: Place, move = false): Moves {
    const lead = this.graph.place(ones[0]?.spawn ?? "");
    if (!lead) return [];
    const used = new Set<string>();
    const others: Body[] = [];
    const without = new Set(move ? ones.map(({ id }) => id) : []);
    const nearest = (one: Actor | Flow, x: number, y: number, walk: boolean): Place | null => {
      const size = this.sizeOf(one);
      for (const reach of FURTHER) {
        const place = this.near(x, y, reach / 3, walk, { besides: used, size, others, without });
        if (place) return place;
      }
      return null;
    };
    return ones.flatMap((one, n) => {
      const old = this.graph.place(one.spawn);
      if (!old) return [];
      const place =
        n === 0 && old.walk === to.walk
          ? to
          : nearest(one, old.x + to.x - lead.x, old.y + to.y - lead.y, old.walk);
      if (!place || used.has(place.id)) return [];
      used.add(place.id);
      const size = this.sizeOf(one);
      if (size) others.push(bodyAt(place, size));
      return [[one.id, place.id] as const];
    });
  }

  private sizeOf({ id }: Actor | Flow): BodySize | null {
    const body = this.bodies.get(id);
    return body ? [body.length, body.width] : null;
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
