import { useCallback, useEffect, useMemo, useState } from "react";

import { api, ApiError } from "../api/client";
import { type RunInfo, runs, type RunState } from "../api/runs";
import type { Bounds, MapDetails } from "../api/types";
import { insideRows, segmentsBounds } from "../editor/scene";
import type { PackedDrawing } from "../map/drawing";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { EMPTY_SCENE, type Scene } from "../map/scene";
import { learnTitle } from "../ui/titles";
import { reasonOf } from "../ui/reason";
import { hasEnded } from "./figures";

const POLL = 700;
/** How often results are asked for after the end; a run that failed early has none. */
const ENOUGH = 20;

export interface Run {
  info: RunInfo | null;
  failure: string | null;
  /** Whether the server does not answer at the moment. */
  lost: boolean;
  /** What the live picture reports sooner than one asks. */
  learn: (state: RunState, speed?: number | null) => void;
}

/** The state of a run; asked rarely, as the picture comes by itself. */
export function useRun(run: string): Run {
  const [info, setInfo] = useState<RunInfo | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const [lost, setLost] = useState(false);
  const ended = info !== null && hasEnded(info.state);
  // The live picture may report the end before its results, or its reason, are there.
  const complete = ended && (info.summary != null || info.error != null);
  useEffect(() => {
    if (complete) return;
    let current = true;
    let left = ENOUGH;
    const ask = (): void => {
      if (ended && left-- <= 0) return;
      runs.info(run).then(
        (found) => {
          if (!current) return;
          setInfo(found);
          setLost(false);
          setFailure(null);
        },
        (error: unknown) => {
          if (!current) return;
          // What is seen stays until the server is back; it is asked again.
          const gone = error instanceof ApiError && error.status > 0 && error.status < 500;
          if (gone) setFailure(reasonOf(error));
          else setLost(true);
        },
      );
    };
    ask();
    const timer = setInterval(ask, POLL);
    return () => {
      current = false;
      clearInterval(timer);
    };
  }, [run, ended, complete]);
  const learn = useCallback(
    (state: RunState, speed?: number | null) =>
      setInfo((old) => old && { ...old, state, speed: speed === undefined ? old.speed : speed }),
    [],
  );
  return { info, failure, lost, learn };
}

export interface Ground {
  map: MapDetails | null;
  drawing: PackedDrawing | null;
  loaded: LoadedGraph | null;
  scene: Scene;
  /** Where the scenario takes place; null if it is gone or nothing is known yet. */
  bounds: Bounds | null;
  failure: string | null;
}

/** The map below a run; of the scenario, which may be gone, only its region. */
export function useGround(name: string | null, scenario: string): Ground {
  const [map, setMap] = useState<MapDetails | null>(null);
  const [drawing, setDrawing] = useState<PackedDrawing | null>(null);
  const [loaded, setLoaded] = useState<LoadedGraph | null>(null);
  const [roi, setRoi] = useState<string[] | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  useEffect(() => {
    if (!name) return;
    const fail = (error: unknown): void => setFailure(reasonOf(error));
    // Side by side, for a person waits.
    api.map(name).then(setMap, fail);
    loadDrawing(name).then(setDrawing, fail);
    loadGraph(name).then(setLoaded, fail);
  }, [name]);
  useEffect(() => {
    api.scenario(scenario).then(
      ({ document }) => {
        setRoi(document.roi);
        learnTitle(scenario, document.name);
      },
      () => setRoi([]),
    );
  }, [scenario]);
  const inside = useMemo(
    () => (loaded && roi && roi.length > 0 ? insideRows(loaded.graph, roi) : null),
    [loaded, roi],
  );
  const bounds = useMemo(() => (loaded && roi ? segmentsBounds(loaded.graph, roi) : null), [loaded, roi]);
  const scene = useMemo<Scene>(
    () => ({ ...EMPTY_SCENE, nodes: { vehicles: false, walks: false, inside } }),
    [inside],
  );
  return { map, drawing, loaded, scene, bounds, failure };
}
