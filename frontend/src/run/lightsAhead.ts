import type { MapDetails } from "../api/types";
import { nth } from "../lists";
import type { Graph } from "../map/graph";
import type { LoadedGraph } from "../map/loaded";
import { mostOf, type Shown } from "../signals/heads";
import { stopNode } from "../signals/queues";
import type { Crowd, Frame } from "./frames";
import { nodeUnder } from "./onLane";

/** Metres before a stop line from which on its light is the one ahead. */
const AHEAD = 100;
/** Metres from the middle of a lane up to which a vehicle is on it. */
const ON_LANE = 2;

/** In the order of the colours; nothing is ahead, or it is off, at 0. */
export const SHOWN_AHEAD: readonly Shown[] = ["off", "green", "permissive", "yellow", "red"];

/** The light at the end of a lane, and the letters of its state that are for this lane. */
interface Controlled {
  light: string;
  letters: number[];
}

/** Which light comes next on each lane; found once for a map. */
export class LightsAhead {
  /** By node of the graph. */
  private readonly controlled: ReadonlyMap<number, Controlled>;

  constructor(
    private readonly loaded: LoadedGraph,
    lights: MapDetails["lights"],
  ) {
    const { graph } = loaded;
    const controlled = stopsOf(graph, lights);
    const before = predecessors(graph);
    // From all stop lines at once, so that each node gets the nearest one; nodes are equally far apart.
    const open = [...controlled.keys()].map((node) => ({ node, away: 0 }));
    for (const { node, away } of open)
      for (const previous of before.get(node) ?? []) {
        const far = away + between(graph, previous, node);
        const one = controlled.get(node);
        if (!one || far > AHEAD || controlled.has(previous)) continue;
        controlled.set(previous, one);
        open.push({ node: previous, away: far });
      }
    this.controlled = controlled;
  }

  /** What the light ahead shows to the lane of a vehicle there; null where none is near or known. */
  at(x: number, y: number, hdg: number, stateOf: (light: string) => string | undefined): Shown | null {
    const node = nodeUnder(this.loaded, x, y, hdg, ON_LANE);
    const one = node === null ? undefined : this.controlled.get(node);
    const state = one && stateOf(one.light);
    return one && state !== undefined ? mostOf(one.letters, state) : null;
  }

  /** The frame with what each row has ahead, as a place in {@link SHOWN_AHEAD}; people on foot have nothing. */
  learn(frame: Frame, crowd: Crowd, stateOf: (light: string) => string | undefined): Frame {
    const ahead = new Uint8Array(frame.count);
    const [east, north] = crowd.origin;
    for (let row = 0; row < frame.count; row++) {
      const [index, x, y, hdg] = [0, 1, 2, 3].map((k) => nth(frame.rows, 6 * row + k)) as [
        number,
        number,
        number,
        number,
      ];
      if (crowd.named(index)?.category === "pedestrian") continue;
      const shown = this.at(x + east, y + north, hdg, stateOf);
      ahead[row] = shown === null ? 0 : SHOWN_AHEAD.indexOf(shown);
    }
    return { ...frame, ahead };
  }
}

function stopsOf(graph: Graph, lights: MapDetails["lights"]): Map<number, Controlled> {
  const stops = new Map<number, Controlled>();
  for (const { id, paths, walks } of lights)
    paths.forEach((path, letter) => {
      if (path.length < 2 || walks[letter]) return;
      const node = stopNode(graph, nth(path, 0), nth(path, 1));
      if (node === null) return;
      const known = stops.get(node);
      if (known) known.letters.push(letter);
      else stops.set(node, { light: id, letters: [letter] });
    });
  return stops;
}

const between = ({ columns }: Graph, a: number, b: number): number =>
  Math.hypot(nth(columns.x, a) - nth(columns.x, b), nth(columns.y, a) - nth(columns.y, b));

/** The nodes from which one comes to each, along lanes. */
function predecessors({ columns: { edges } }: Graph): Map<number, number[]> {
  const found = new Map<number, number[]>();
  edges.source.forEach((source, n) => {
    if (edges.relation[n] !== 0) return;
    const target = nth(edges.target, n);
    const known = found.get(target);
    if (known) known.push(source);
    else found.set(target, [source]);
  });
  return found;
}
