import type { GraphColumns, HeightColumns } from "../api/types";
import { nth } from "../lists";

/** Metres of a cell in which nodes are looked up. */
const CELL = 8;
/** Cells around a place that are looked into at most, until nodes are found. */
const MOST_RINGS = 4;
/** Nodes further apart than this in height are on roads that pass over each other, m. */
const STOREY = 2.5;
/** Least cosine between directions of the same road. */
const ALONG = 0.7;
/** Keeps a plane level across the only lane that it is laid through. */
const RIDGE = 1e-3;

interface Plane {
  /** Height at the place, m. */
  z: number;
  /** Rise per metre to the east and to the north. */
  east: number;
  north: number;
}

/** Which of several roads above each other is meant. */
interface Which {
  /** How many roads are below it. */
  level?: number;
  /** Direction of who is on it, radians. */
  hdg?: number;
}

/** Nodes around a cell, from the lowest up. */
interface Around {
  nodes: readonly number[];
  storeys: readonly (readonly number[])[];
}

/** How high the ground is: planes through the nodes of the lane graph around a place. */
export class Heights {
  /** Whether all of the map has one height. */
  readonly flat: boolean;
  private readonly x: readonly number[];
  private readonly y: readonly number[];
  private readonly z: readonly number[];
  /** Heights of the lowest and the highest node, m. */
  readonly lowest: number;
  readonly highest: number;
  private readonly cos: readonly number[];
  private readonly sin: readonly number[];
  private readonly cells = new Map<number, number[]>();
  /** What has been looked up: nodes around a cell from the lowest up, and its storeys. */
  private readonly around = new Map<number, Around>();

  constructor(graph: Pick<GraphColumns, "x" | "y" | "hdg" | "walks">, { z, walks }: HeightColumns) {
    this.x = [...graph.x, ...graph.walks.x];
    this.y = [...graph.y, ...graph.walks.y];
    const hdg = [...graph.hdg, ...graph.walks.hdg];
    this.cos = hdg.map(Math.cos);
    this.sin = hdg.map(Math.sin);
    this.z = [...z, ...walks];
    this.flat = this.z.length === 0;
    this.lowest = this.flat ? 0 : this.z.reduce((low, height) => Math.min(low, height), Infinity);
    this.highest = this.flat ? 0 : this.z.reduce((high, height) => Math.max(high, height), -Infinity);
    z.forEach((_, node) => this.put(node));
    // Walks lie a kerb higher: beside a road its own nodes say how high the ground is.
    const apart = walks
      .map((_, n) => z.length + n)
      .filter((node) => this.near(...this.cell(node), 1).length === 0);
    for (const node of apart) this.put(node);
  }

  private put(node: number): void {
    const key = cellOf(...this.cell(node));
    const cell = this.cells.get(key);
    if (cell) cell.push(node);
    else this.cells.set(key, [node]);
  }

  private cell(node: number): [number, number] {
    return [Math.floor(nth(this.x, node) / CELL), Math.floor(nth(this.y, node) / CELL)];
  }

  /** Height of the ground at a place, m. */
  at(x: number, y: number, which: Which = {}): number {
    return this.plane(x, y, which).z;
  }

  /** Height and slope of the ground at a place; level where no node is near. */
  plane(x: number, y: number, which: Which = {}): Plane {
    if (this.flat) return { z: 0, east: 0, north: 0 };
    const near = this.chosen(this.lookAround(Math.floor(x / CELL), Math.floor(y / CELL)), which);
    if (near.length === 0) return { z: this.lowest, east: 0, north: 0 };
    return this.fitted(near, x, y);
  }

  /** Nodes in the cells around one, as far as it takes to find some. */
  private near(column: number, row: number, most = MOST_RINGS): number[] {
    for (let rings = 1; rings <= most; rings++) {
      const found: number[] = [];
      for (let i = column - rings; i <= column + rings; i++)
        for (let j = row - rings; j <= row + rings; j++) found.push(...(this.cells.get(cellOf(i, j)) ?? []));
      if (found.length > 0) return found;
    }
    return [];
  }

  private lookAround(column: number, row: number): Around {
    const key = cellOf(column, row);
    const known = this.around.get(key);
    if (known) return known;
    const nodes = this.near(column, row).sort((a, b) => nth(this.z, a) - nth(this.z, b));
    const found = { nodes, storeys: this.storeysOf(nodes) };
    this.around.set(key, found);
    return found;
  }

  private chosen({ nodes, storeys }: Around, { level = 0, hdg }: Which): readonly number[] {
    let stacked = storeys;
    if (hdg !== undefined) {
      const [cos, sin] = [Math.cos(hdg), Math.sin(hdg)];
      const along = nodes.filter((node) => nth(this.cos, node) * cos + nth(this.sin, node) * sin > ALONG);
      if (along.length > 0) stacked = this.storeysOf(along);
    }
    return stacked[Math.min(level, stacked.length - 1)] ?? [];
  }

  /** Nodes parted where the next is much higher; they come from the lowest up. */
  private storeysOf(nodes: readonly number[]): number[][] {
    const storeys: number[][] = [];
    nodes.forEach((node, k) => {
      const above = k > 0 && nth(this.z, node) - nth(this.z, nth(nodes, k - 1)) > STOREY;
      if (k === 0 || above) storeys.push([]);
      storeys.at(-1)?.push(node);
    });
    return storeys;
  }

  /** The plane nearest to nodes, by least squares weighted with their distance from a place. */
  private fitted(nodes: readonly number[], x0: number, y0: number): Plane {
    let [w0, wx, wy, wxx, wxy, wyy, wz, wxz, wyz] = [0, 0, 0, 0, 0, 0, 0, 0, 0];
    for (const node of nodes) {
      const [x, y, z] = [nth(this.x, node) - x0, nth(this.y, node) - y0, nth(this.z, node)];
      const w = 1 / (x * x + y * y + 1) ** 2;
      w0 += w;
      wx += w * x;
      wy += w * y;
      wxx += w * x * x;
      wxy += w * x * y;
      wyy += w * y * y;
      wz += w * z;
      wxz += w * x * z;
      wyz += w * y * z;
    }
    // About the weighted middle, where the height does not depend on the slope.
    const [mx, my, mz] = [wx / w0, wy / w0, wz / w0];
    const [xx, xy, yy] = [wxx - wx * mx, wxy - wx * my, wyy - wy * my];
    const [xz, yz] = [wxz - wx * mz, wyz - wy * mz];
    const ridge = RIDGE * (xx + yy) + 1e-12;
    const det = (xx + ridge) * (yy + ridge) - xy * xy;
    const east = ((yy + ridge) * xz - xy * yz) / det;
    const north = ((xx + ridge) * yz - xy * xz) / det;
    return { z: mz - east * mx - north * my, east, north };
  }
}

/** A number for each cell of a map. */
const cellOf = (column: number, row: number): number => column * 2 ** 24 + row;
