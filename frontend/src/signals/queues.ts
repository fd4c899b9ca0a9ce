import type { MapDetails } from "../api/types";
import { nth } from "../lists";
import type { Graph } from "../map/graph";
import type { Frame } from "../run/frames";

/** Who waits before a light on one of its approaches. */
export interface Queue {
  /** Segment before the junction. */
  approach: string;
  vehicles: number;
  /** From the stop line to the rear of the last one, in the longest lane. */
  metres: number;
}

/** Below 5 mi/h a vehicle is queued if it is near the stop line or the rear of one that is (HCM). */
const QUEUED = 5 * 0.44704;
const NEAR = 10;
/** Metres before the stop line that are looked at. */
const REACH = 300;
/** Metres from the middle of the lane within which a vehicle is on it. */
const BESIDE = 1.6;
const COS_ALONG = Math.cos(Math.PI / 3);

/** The lane before a stop line: its nodes from there back, with their metres. */
interface QueueLane {
  approach: string;
  nodes: { x: number; y: number; hdg: number; back: number }[];
}

/** The lanes before one light, found once. */
export class QueueLanes {
  private readonly lanes: QueueLane[] = [];

  constructor(graph: Graph, light: MapDetails["lights"][number]) {
    const { columns } = graph;
    const before = predecessors(graph);
    const seen = new Set<number>();
    light.paths.forEach((path, n) => {
      if (path.length < 2 || light.walks[n]) return;
      const first = stopNode(graph, nth(path, 0), nth(path, 1));
      if (first === null || seen.has(first)) return;
      seen.add(first);
      const nodes = [];
      let back = 0;
      for (let at: number | undefined = first; at !== undefined && back <= REACH;) {
        nodes.push({ x: nth(columns.x, at), y: nth(columns.y, at), hdg: nth(columns.hdg, at), back });
        const next: number | undefined = before.get(at);
        if (next !== undefined)
          back += Math.hypot(
            nth(columns.x, at) - nth(columns.x, next),
            nth(columns.y, at) - nth(columns.y, next),
          );
        at = next;
      }
      this.lanes.push({ approach: graph.segmentId(nth(columns.segment, first)), nodes });
    });
  }

  /** Queues by approach, in the order of the light. */
  at(frame: Frame, lengthOf: (index: number) => number | null, origin: readonly [number, number]): Queue[] {
    const found = new Map<string, Queue>();
    for (const { approach, nodes } of this.lanes) {
      const waiting: { front: number; rear: number }[] = [];
      for (let row = 0; row < frame.count; row++) {
        const [index, x, y, hdg, speed] = [0, 1, 2, 3, 4].map((k) => nth(frame.rows, 6 * row + k)) as [
          number,
          number,
          number,
          number,
          number,
        ];
        if (speed >= QUEUED) continue;
        const length = lengthOf(index);
        if (length === null) continue;
        const middle = along(nodes, x + origin[0], y + origin[1], hdg);
        if (middle !== null) waiting.push({ front: middle - length / 2, rear: middle + length / 2 });
      }
      waiting.sort((a, b) => a.front - b.front);
      const one = found.get(approach) ?? { approach, vehicles: 0, metres: 0 };
      let rear = 0;
      for (const vehicle of waiting) {
        if (vehicle.front - rear > NEAR) break;
        rear = Math.max(rear, vehicle.rear);
        one.vehicles += 1;
      }
      one.metres = Math.max(one.metres, rear);
      found.set(approach, one);
    }
    return [...found.values()];
  }
}

/** Metres before the stop line; null if it is not on the lane. */
function along(nodes: QueueLane["nodes"], x: number, y: number, hdg: number): number | null {
  let best: number | null = null;
  let least = Infinity;
  for (const node of nodes) {
    const [dx, dy] = [x - node.x, y - node.y];
    if (Math.abs(dx) > 2 || Math.abs(dy) > 2) continue;
    const [cos, sin] = [Math.cos(node.hdg), Math.sin(node.hdg)];
    if (Math.abs(dy * cos - dx * sin) > BESIDE || Math.cos(hdg - node.hdg) < COS_ALONG) continue;
    const away = Math.hypot(dx, dy);
    if (away < least) [least, best] = [away, node.back - (dx * cos + dy * sin)];
  }
  return best === null ? null : Math.max(0, best);
}

/** The last node before the stop line where a path across a junction begins; null if there is no lane. */
export function stopNode(graph: Graph, [x, y]: [number, number], [tx, ty]: [number, number]): number | null {
  return nearest(graph, x, y, Math.atan2(ty - y, tx - x));
}

function nearest(graph: Graph, x: number, y: number, hdg: number): number | null {
  const { columns } = graph;
  let best: number | null = null;
  let least = 6;
  for (let i = 0; i < columns.x.length; i++) {
    const [dx, dy] = [nth(columns.x, i) - x, nth(columns.y, i) - y];
    const own = nth(columns.hdg, i);
    // Before the stop line, in its lane.
    if (dx * Math.cos(own) + dy * Math.sin(own) > 0.5) continue;
    if (Math.abs(dy * Math.cos(own) - dx * Math.sin(own)) > BESIDE) continue;
    if (Math.cos(own - hdg) < COS_ALONG) continue;
    const away = Math.hypot(dx, dy);
    if (away < least) [least, best] = [away, i];
  }
  return best;
}

/** The node from which one comes to each; of several the first. */
function predecessors({ columns: { edges } }: Graph): Map<number, number> {
  const found = new Map<number, number>();
  edges.source.forEach((source, n) => {
    const target = nth(edges.target, n);
    if (edges.relation[n] === 0 && !found.has(target)) found.set(target, source);
  });
  return found;
}
