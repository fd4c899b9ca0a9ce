import { useCallback, useEffect, useMemo, useState } from "react";

import { runs } from "../api/runs";
import { ringOf } from "../map/graph";
import { laneKey } from "../map/laneShapes";
import type { LoadedGraph } from "../map/loaded";
import type { Pointed } from "../map/MapCanvas";
import type { LaneColors } from "../map/scene";
import { reasonOf } from "../ui/reason";
import {
  boundsOf,
  classOf,
  type LanesBy,
  type LaneSight,
  LaneUse,
  sequential,
  valueText,
  wordsOf,
} from "./laneUse";

/** Metres from the middle of a lane up to which a point is on it. */
const ON_LANE = 3;

/** The colours of lanes, and what they mean. */
export interface LaneLegend {
  colors: readonly string[];
  words: readonly string[];
}

export interface ShownUse {
  by: LanesBy | null;
  choose: (by: LanesBy | null) => void;
  /** Seconds at which intervals begin, and the last ends; empty until they are known. */
  times: readonly number[];
  /** Intervals that are shown, from the first up to before the last. */
  span: readonly [number, number];
  setSpan: (span: readonly [number, number]) => void;
  legend: LaneLegend | null;
  colors: LaneColors | null;
  /** The lane that was pointed at last, and its value in words. */
  pointed: { lane: string; value: string } | null;
  point: (at: Pointed) => void;
  failure: string | null;
}

/** How lanes were used in a run that has ended; asked for once any view wants to see it. */
export interface LaneData {
  use: LaneUse | null;
  /** The area of each stretch of a lane. */
  rings: readonly { lane: number; ring: Float64Array }[] | null;
  failure: string | null;
  ask: () => void;
}

export function useLaneData(run: string, loaded: LoadedGraph | null): LaneData {
  const [wanted, want] = useState(false);
  const [use, setUse] = useState<LaneUse | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  useEffect(() => {
    if (!wanted) return;
    let current = true;
    runs.lanes(run).then(
      (columns) => {
        if (current) setUse(new LaneUse(columns));
      },
      (error: unknown) => {
        if (current) setFailure(reasonOf(error));
      },
    );
    return () => {
      current = false;
    };
  }, [run, wanted]);
  const rings = useMemo(() => {
    if (!use || !loaded) return null;
    const { node_first, node_end, node_lane } = use.columns;
    const { columns } = loaded.graph;
    return node_lane.map((lane, k) => ({
      lane,
      ring: ringOf(columns, node_first[k] ?? 0, node_end[k] ?? 0),
    }));
  }, [use, loaded]);
  const ask = useCallback(() => want(true), []);
  return useMemo(() => ({ use, rings, failure, ask }), [use, rings, failure, ask]);
}

/** What one view shows of it: `sight` of a run that has lane data, changed by `show`. */
export function useLaneUse(
  { use, rings, failure, ask }: LaneData,
  loaded: LoadedGraph | null,
  sight: LaneSight | null,
  show: (next: LaneSight | null) => void,
): ShownUse {
  const by = sight?.by ?? null;
  const [node, setNode] = useState<number | null>(null);
  useEffect(() => {
    if (by !== null) ask();
  }, [by, ask]);

  const last = use?.intervals ?? 0;
  // A link may be about another length of the run.
  const [from, to] = sight?.span && sight.span[1] <= last ? sight.span : [0, last];
  const choose = (next: LanesBy | null): void => show(next && { by: next, span: sight?.span ?? null });
  const setSpan = (span: readonly [number, number]): void => {
    if (by) show({ by, span: span[0] === 0 && span[1] === last ? null : span });
  };
  const bounds = useMemo(() => (use && by ? boundsOf(use.values(by)) : null), [use, by]);
  const values = useMemo(() => (use && by ? use.values(by, from, to) : null), [use, by, from, to]);
  const legend = useMemo(
    () => (by && bounds ? { colors: sequential(bounds.length + 1), words: wordsOf(by, bounds) } : null),
    [by, bounds],
  );
  const colors = useMemo(() => {
    if (!legend || !bounds || !values || !rings) return null;
    const found: Float64Array[][] = legend.colors.map(() => []);
    for (const { lane, ring } of rings) found[classOf(bounds, values[lane] ?? NaN) ?? -1]?.push(ring);
    return { colors: legend.colors, rings: found };
  }, [legend, bounds, values, rings]);

  const point = useCallback(
    ({ x, y, reach }: Pointed) => {
      const found = loaded?.picker.place(x, y, Math.max(reach, ON_LANE), { vehicles: true, walks: false });
      if (found) setNode(found.index);
    },
    [loaded],
  );
  const pointed = useMemo(() => {
    if (node === null || !by || !use || !values || !loaded) return null;
    const row = use.rowOf(node);
    return {
      lane: laneKey(loaded.graph, node),
      value: valueText(by, row === null ? NaN : (values[row] ?? NaN)),
    };
  }, [node, by, use, values, loaded]);
  const times = use?.columns.times ?? [];
  return { by, choose, times, span: [from, to], setSpan, legend, colors, pointed, point, failure };
}
