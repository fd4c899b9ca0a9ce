import Flatbush from "flatbush";

import type { GraphColumns } from "../api/types";
import { nth } from "../lists";
import { Graph, type Place } from "./graph";

export interface PickOptions {
  vehicles: boolean;
  walks: boolean;
  /** Rows of segments that may be picked in; all of them without. */
  inside?: ReadonlySet<number>;
  /** Whether a place may be picked; all of them without. */
  allowed?: (index: number, walk: boolean) => boolean;
}

/** Finds what lies under the pointer. */
export class Picker {
  private readonly nodes: Flatbush | null;
  private readonly walks: Flatbush | null;

  constructor(private readonly graph: Graph) {
    this.nodes = indexed(graph.columns);
    this.walks = indexed(graph.columns.walks);
  }

  /** The nearest place within `reach` metres. */
  place(x: number, y: number, reach: number, options: PickOptions): Place | null {
    const { columns } = this.graph;
    const found: Place[] = [];
    if (options.vehicles) {
      const i = nearest(this.nodes, x, y, reach, columns.segment, false, options);
      if (i !== undefined) found.push(this.graph.vehiclePlace(i));
    }
    if (options.walks) {
      const i = nearest(this.walks, x, y, reach, columns.walks.segment, true, options);
      if (i !== undefined) found.push(this.graph.walkPlace(i));
    }
    const away = (p: Place): number => Math.hypot(p.x - x, p.y - y);
    return found.sort((a, b) => away(a) - away(b))[0] ?? null;
  }

  /** Row of the segment whose lane is nearest. */
  segment(x: number, y: number, reach: number): number | null {
    const i = nearest(this.nodes, x, y, reach, this.graph.columns.segment, false);
    return i === undefined ? null : nth(this.graph.columns.segment, i);
  }

  /** Rows of the nodes in a rectangle. */
  within(minX: number, minY: number, maxX: number, maxY: number, walks: boolean): number[] {
    return (walks ? this.walks : this.nodes)?.search(minX, minY, maxX, maxY) ?? [];
  }
}

function indexed(columns: Pick<GraphColumns, "x" | "y">): Flatbush | null {
  if (columns.x.length === 0) return null;
  const index = new Flatbush(columns.x.length);
  for (let i = 0; i < columns.x.length; i++) index.add(nth(columns.x, i), nth(columns.y, i));
  index.finish();
  return index;
}

function nearest(
  index: Flatbush | null,
  x: number,
  y: number,
  reach: number,
  segment: number[],
  walk: boolean,
  { inside, allowed }: Pick<PickOptions, "inside" | "allowed"> = {},
): number | undefined {
  const filter =
    (inside || allowed) &&
    ((i: number): boolean => (!inside || inside.has(nth(segment, i))) && (!allowed || allowed(i, walk)));
  return index?.neighbors(x, y, 1, reach, filter)[0];
}
