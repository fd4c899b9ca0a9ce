import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { signals } from "../api/signals";
import type { MapDetails } from "../api/types";
import { changed, ShownSignal, type SignalNow } from "./cursor";
import { type Head, Heads } from "./heads";

export interface LightHistory {
  times: readonly number[];
  states: readonly string[];
  /** Plans of the day that ran, as they were logged. */
  plans?: readonly string[];
}

export interface RunLights {
  heads: Heads | null;
  /** The state of a light at a time, where it is known. */
  stateOf: (light: string, time: number) => string | undefined;
  /** What is shown at a time, at all stop lines. */
  drawn: (time: number) => Head[];
  /** What the light of a junction shows. */
  now: (junction: string, time: number) => SignalNow | null;
  /** All that the light of a junction has shown so far; of a live run since one began to look. */
  history: (junction: string) => LightHistory | null;
  /** Takes in what has changed in a live run. */
  learn: (lights: Record<string, string>, time: number) => void;
  /** The same of detectors. */
  learnDetectors: (detectors: Record<string, boolean>) => void;
  /** Ids of the detectors that are occupied in a live run. */
  occupied: ReadonlySet<string>;
  /** Counts what was learned, for those who draw. */
  turn: number;
  /** Whether there is anything to show. */
  known: boolean;
}

/** States of all lights of a run: as they come, or as they were logged. */
export function useRunLights(run: string, map: MapDetails | null, recorded: boolean): RunLights {
  const heads = useMemo(() => map && new Heads(map.lights), [map]);
  const live = useRef(new Map<string, SignalNow>());
  const seen = useRef(new Map<string, { times: number[]; states: string[] }>());
  const [logged, setLogged] = useState<ReadonlyMap<string, ShownSignal> | null>(null);
  const [turn, setTurn] = useState(0);
  const [occupied, setOccupied] = useState<ReadonlySet<string>>(new Set());
  useEffect(() => {
    if (!recorded) return;
    let current = true;
    signals.shown(run).then(
      ({ lights }) => {
        if (current) setLogged(new Map(lights.map((one) => [one.light, new ShownSignal(one)])));
      },
      // A run of before has no log: the recording is shown without lights.
      () => undefined,
    );
    return () => {
      current = false;
    };
  }, [run, recorded]);
  const learn = useCallback((lights: Record<string, string>, time: number) => {
    for (const [light, state] of Object.entries(lights)) {
      // A connection that is made again reports all of them.
      if (live.current.get(light)?.state === state) continue;
      live.current.set(light, changed(live.current.get(light), state, time));
      const of = seen.current.get(light) ?? { times: [], states: [] };
      of.times.push(time);
      of.states.push(state);
      seen.current.set(light, of);
    }
    setTurn((n) => n + 1);
  }, []);
  const learnDetectors = useCallback((detectors: Record<string, boolean>) => {
    setOccupied((old) => {
      const next = new Set(old);
      for (const [id, on] of Object.entries(detectors)) {
        if (on) next.add(id);
        else next.delete(id);
      }
      return next;
    });
  }, []);
  const nowOf = useCallback(
    (light: string, time: number): SignalNow | null => {
      if (recorded) return logged?.get(light)?.at(time) ?? null;
      const one = live.current.get(light);
      return one ? { ...one, time } : null;
    },
    [recorded, logged],
  );
  const stateOf = useCallback((light: string, time: number) => nowOf(light, time)?.state, [nowOf]);
  const drawn = useCallback(
    (time: number): Head[] => heads?.at((light) => stateOf(light, time)) ?? [],
    [heads, stateOf],
  );
  const now = useCallback(
    (junction: string, time: number): SignalNow | null => {
      const light = map?.lights.find(({ names }) => names.includes(junction));
      return light ? nowOf(light.id, time) : null;
    },
    [map, nowOf],
  );
  const history = useCallback(
    (junction: string): LightHistory | null => {
      const light = map?.lights.find(({ names }) => names.includes(junction))?.id ?? "";
      return (recorded ? logged?.get(light)?.history : seen.current.get(light)) ?? null;
    },
    [map, recorded, logged],
  );
  const known = recorded ? (logged?.size ?? 0) > 0 : turn > 0;
  return useMemo(
    () => ({ heads, stateOf, drawn, now, history, learn, learnDetectors, occupied, turn, known }),
    [heads, stateOf, drawn, now, history, learn, learnDetectors, occupied, turn, known],
  );
}
