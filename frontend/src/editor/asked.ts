import { useEffect, useMemo, useRef, useState } from "react";

import { api } from "../api/client";
import { runs, type RunWish } from "../api/runs";
import type { Actor, Flow, Roi } from "../api/types";
import { nth } from "../lists";
import type { Graph, Place } from "../map/graph";
import { tellError } from "../ui/notices";
import type { View } from "../map/view";
import { hashOf } from "../ui/address";
import { openedWith } from "../ui/kept";
import type { Trial } from "./handlers/handler";
import { stationsOf, viasOf } from "./placing";

const NO_ROI: Roi = { inside: [], candidates: [], removable: [] };

/** What was last said of the region, and whether that still is about the region as it is now. */
export interface Region extends Roi {
  current: boolean;
}

/**
 * What may be added to the region and taken out of it; asked of the server, which knows the rule. A region
 * that is foreseen is asked for again with the version in which the server has it.
 */
export function useRegion(name: string, roiKey: string, version: number): Region {
  const [{ roi, key }, setAnswer] = useState<{ roi: Roi; key: string | null }>({ roi: NO_ROI, key: null });
  const known = key === roiKey;
  useEffect(() => {
    if (known) return;
    let current = true;
    api.roi(name).then((found) => {
      if (current) setAnswer({ roi: found, key: found.inside.join("\n") });
    }, tellError);
    return () => {
      current = false;
    };
  }, [name, roiKey, version, known]);
  return useMemo(() => ({ ...roi, current: known }), [roi, known]);
}

export interface Goals {
  /** Null until they are known. */
  goals: Place[] | null;
  /** Points of the route to the goal that is chosen, from each station to the next. */
  legs: [number, number][][];
}

/** Where the selected one can go, and its route to its goal. */
export function useGoals(name: string, one: Actor | Flow | null, roiKey: string, graph: Graph): Goals {
  const [goals, setGoals] = useState<Place[] | null>(null);
  const [legs, setLegs] = useState<[number, number][][]>([]);
  // A text, as the same places are another array with every edit.
  const stations = JSON.stringify(one ? stationsOf(one) : []);
  const last = one ? (viasOf(one).at(-1) ?? one.spawn) : null;
  useEffect(() => {
    setGoals(null);
    if (last === null) return;
    let current = true;
    api.goals(name, last).then(
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
  }, [name, last, roiKey, graph]);
  useEffect(() => {
    setLegs([]);
    const places = JSON.parse(stations) as string[];
    if (places.length < 2) return;
    let current = true;
    legsOf(name, places).then(
      (found) => {
        if (current) setLegs(found);
      },
      () => undefined,
    );
    return () => {
      current = false;
    };
  }, [name, stations, roiKey]);
  return { goals, legs };
}

/** Points of a route from each station to the next; none where no route leads. */
const legsOf = async (name: string, stations: readonly string[]): Promise<[number, number][][]> =>
  (
    await Promise.all(stations.slice(1).map((place, index) => api.path(name, nth(stations, index), place)))
  ).map(({ points }) => points);

/** The route of a {@link Trial}, as far as the server has answered. */
export interface TrialRoute {
  /** Points of the newest route that is known; it may lag behind the pointer. */
  points: [number, number][];
  /** Whether there is a route for what is pointed at; null until that is known. */
  possible: boolean | null;
}

const NO_ROUTE: TrialRoute = { points: [], possible: null };

/** Asks for the route of what is pointed at: one question at a time, the newest next. */
export function useTrial(name: string, trial: Trial | null): TrialRoute {
  const [found, setFound] = useState<TrialRoute & { key: string }>({ ...NO_ROUTE, key: "" });
  const wanted = useRef<Trial | null>(null);
  const busy = useRef(false);
  const key = trial ? trial.join("\n") : "";
  useEffect(() => {
    wanted.current = trial;
    const ask = (): void => {
      const now = wanted.current;
      if (!now || busy.current) return;
      busy.current = true;
      const asked = now.join("\n");
      const learn = (route: TrialRoute): void => {
        busy.current = false;
        setFound({ ...route, key: asked });
        if (wanted.current && wanted.current !== now) ask();
      };
      legsOf(name, now).then(
        (legs) => learn({ points: legs.flat(), possible: legs.every(({ length }) => length > 0) }),
        () => learn({ points: [], possible: false }),
      );
    };
    ask();
    // By its key: the same trial is another object with every move of the pointer.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [name, key]);
  return useMemo(() => {
    if (!key) return NO_ROUTE;
    return found.key === key ? found : { points: found.points, possible: null };
  }, [found, key]);
}

/** Starts a run and leads to it, with a part of the map in sight. */
export function useStarter(name: string): {
  busy: boolean;
  start: (wish: RunWish, at?: View | null) => void;
} {
  const [busy, setBusy] = useState(false);
  return {
    busy,
    start: (wish, at) => {
      setBusy(true);
      runs.start(wish).then(
        ({ run }) => {
          const hash = hashOf({ view: "run", scenario: name, run });
          location.hash = at ? openedWith(hash, { at }) : hash;
        },
        (error: unknown) => {
          setBusy(false);
          tellError(error);
        },
      );
    },
  };
}
