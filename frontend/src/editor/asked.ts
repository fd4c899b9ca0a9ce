import { useEffect, useMemo, useState } from "react";

import { api } from "../api/client";
import { runs, type RunWish } from "../api/runs";
import type { Actor, Flow, Roi } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { tellError } from "../ui/notices";
import { go } from "../ui/address";

const NO_ROI: Roi = { inside: [], candidates: [], removable: [] };

/** What was last said of the region, and whether that still is about the region as it is now. */
export interface Region extends Roi {
  current: boolean;
}

/** What may be added to the region and taken out of it; asked of the server, which knows the rule. */
export function useRegion(name: string, roiKey: string): Region {
  const [{ roi, key }, setAnswer] = useState<{ roi: Roi; key: string | null }>({ roi: NO_ROI, key: null });
  useEffect(() => {
    let current = true;
    api.roi(name).then((found) => {
      if (current) setAnswer({ roi: found, key: roiKey });
    }, tellError);
    return () => {
      current = false;
    };
  }, [name, roiKey]);
  return useMemo(() => ({ ...roi, current: key === roiKey }), [roi, key, roiKey]);
}

export interface Goals {
  /** Null until they are known. */
  goals: Place[] | null;
  /** Points of the route to the goal that is chosen. */
  route: [number, number][];
}

/** Where the selected one can go, and its route to its goal. */
export function useGoals(name: string, one: Actor | Flow | null, roiKey: string, graph: Graph): Goals {
  const [goals, setGoals] = useState<Place[] | null>(null);
  const [route, setRoute] = useState<[number, number][]>([]);
  const spawn = one?.spawn ?? null;
  const goal = one?.goal ?? null;
  useEffect(() => {
    setGoals(null);
    if (spawn === null) return;
    let current = true;
    api.goals(name, spawn).then(
      (found) => {
        if (current) setGoals(found.goals.flatMap((id) => graph.place(id) ?? []));
      },
      () => {
        if (current) setGoals([]);
      },
    );
    return () => {
      current = false;
    };
  }, [name, spawn, roiKey, graph]);
  useEffect(() => {
    setRoute([]);
    if (spawn === null || goal === null) return;
    let current = true;
    api.path(name, spawn, goal).then(
      (found) => {
        if (current) setRoute(found.points);
      },
      () => undefined,
    );
    return () => {
      current = false;
    };
  }, [name, spawn, goal, roiKey]);
  return { goals, route };
}

/** Starts a run and leads to it. */
export function useStarter(name: string): { busy: boolean; start: (wish: RunWish) => void } {
  const [busy, setBusy] = useState(false);
  return {
    busy,
    start: (wish) => {
      setBusy(true);
      runs.start(wish).then(
        ({ run }) => go({ view: "run", scenario: name, run }),
        (error: unknown) => {
          setBusy(false);
          tellError(error);
        },
      );
    },
  };
}
