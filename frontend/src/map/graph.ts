import type { Bounds, GraphColumns, WalkColumns } from "../api/types";
import { nth } from "../lists";
import { NO_NAMES, type PlaceNames } from "./placeNames";

/** A place on the map where something can start or go. */
export interface Place {
  /** Whether it is a place for pedestrians. */
  walk: boolean;
  index: number;
  id: string;
  x: number;
  y: number;
  hdg: number;
  /** Row of the segment. */
  segment: number;
}

interface Keyed {
  lane_keys: string[];
  first_node: number[];
  lane: number[];
}

function nodeId(columns: Keyed, index: number, prefix: string): string {
  const lane = nth(columns.lane, index);
  return `${prefix}${nth(columns.lane_keys, lane)}.${index - nth(columns.first_node, lane)}`;
}

/** The graph of a map with its names; the columns are used as they came. */
export class Graph {
  readonly segmentRow = new Map<string, number>();
  private readonly places = new Map<string, Place>();

  constructor(
    readonly columns: GraphColumns,
    readonly names: PlaceNames = NO_NAMES,
  ) {
    columns.segments.forEach((one, row) => this.segmentRow.set(one.id, row));
    for (let i = 0; i < columns.x.length; i++) this.put(this.vehiclePlace(i));
    for (let i = 0; i < columns.walks.x.length; i++) this.put(this.walkPlace(i));
  }

  private put(place: Place): void {
    this.places.set(place.id, place);
  }

  place(id: string): Place | undefined {
    return this.places.get(id);
  }

  vehiclePlace(index: number): Place {
    const c = this.columns;
    return {
      walk: false,
      index,
      id: nodeId(c, index, ""),
      x: nth(c.x, index),
      y: nth(c.y, index),
      hdg: nth(c.hdg, index),
      segment: nth(c.segment, index),
    };
  }

  walkPlace(index: number): Place {
    const w: WalkColumns = this.columns.walks;
    return {
      walk: true,
      index,
      id: nodeId(w, index, WALK_PREFIX),
      x: nth(w.x, index),
      y: nth(w.y, index),
      hdg: nth(w.hdg, index),
      segment: nth(w.segment, index),
    };
  }

  /** Whether the simulator can insert a road user exactly here. */
  usable(index: number, walk: boolean): boolean {
    return (walk ? this.columns.walks.walkable : this.columns.spawnable)[index] === 1;
  }

  /** First and last index, exclusive, of the places of one lane or walkway. */
  lanePlaces({ walk, index }: Pick<Place, "walk" | "index">): [first: number, end: number] {
    const c: Keyed = walk ? this.columns.walks : this.columns;
    const lane = nth(c.lane, index);
    return [nth(c.first_node, lane), c.first_node[lane + 1] ?? c.lane.length];
  }

  segmentId(row: number): string {
    return nth(this.columns.segments, row).id;
  }
}

/** What the names of places for pedestrians begin with. */
export const WALK_PREFIX = "ped.";

/** A strip of one lane that lies in one segment: a ring, x and y in turn. */
export interface Strip {
  segment: number;
  ring: Float64Array;
}

/** Strips of all lanes, cut where the segment changes; the shapes that segments are drawn with. */
export function strips(columns: GraphColumns): Strip[] {
  const found: Strip[] = [];
  for (let lane = 0; lane + 1 < columns.first_node.length; lane++) {
    const end = nth(columns.first_node, lane + 1);
    let from = nth(columns.first_node, lane);
    for (let i = from + 1; i <= end; i++) {
      if (i === end || nth(columns.segment, i) !== nth(columns.segment, from)) {
        found.push({ segment: nth(columns.segment, from), ring: ringOf(columns, from, i) });
        from = i;
      }
    }
  }
  return found;
}

/** The strip through nodes `from` to `end`, lengthened by half a spacing at both ends. */
export function ringOf(c: GraphColumns, from: number, end: number): Float64Array {
  const n = end - from + 2;
  const ring = new Float64Array(4 * n);
  const half = c.spacing / 2;
  for (let k = 0; k < n; k++) {
    const i = Math.min(Math.max(from + k - 1, from), end - 1);
    const shift = k === 0 ? -half : k === n - 1 ? half : 0;
    const cos = Math.cos(nth(c.hdg, i));
    const sin = Math.sin(nth(c.hdg, i));
    const x = nth(c.x, i) + shift * cos;
    const y = nth(c.y, i) + shift * sin;
    const w = nth(c.width, i) / 2;
    ring[2 * k] = x - w * sin;
    ring[2 * k + 1] = y + w * cos;
    ring[2 * (2 * n - 1 - k)] = x + w * sin;
    ring[2 * (2 * n - 1 - k) + 1] = y - w * cos;
  }
  return ring;
}

/** Bounds of each segment, from its nodes. */
export function segmentBounds(columns: GraphColumns): Bounds[] {
  const bounds: Bounds[] = columns.segments.map(() => [Infinity, Infinity, -Infinity, -Infinity]);
  for (let i = 0; i < columns.x.length; i++) {
    const b = nth(bounds, nth(columns.segment, i));
    b[0] = Math.min(b[0], nth(columns.x, i));
    b[1] = Math.min(b[1], nth(columns.y, i));
    b[2] = Math.max(b[2], nth(columns.x, i));
    b[3] = Math.max(b[3], nth(columns.y, i));
  }
  return bounds;
}
