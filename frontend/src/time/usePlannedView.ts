import { t } from "@lingui/core/macro";
import { useEffect, useState } from "react";

import type { EditorNow } from "../editor/useEditing";
import { nth } from "../lists";
import type { Pointed } from "../map/MapCanvas";
import type { Scene } from "../map/scene";
import { clock } from "../language/moments";
import { type Plan, usePlanned } from "./usePlanned";

export interface PlannedView {
  plan: Plan;
  /** The moment that was chosen, seconds; null while the map shows the starts. */
  moment: number | null;
  setMoment: (moment: number | null) => void;
  /** Whether the map shows the plan now: not while something is in the hand. */
  shown: boolean;
  hint: string;
  /** Selects who is planned to be there. */
  pick: (at: Pointed) => void;
}

/** A scene without what the plan takes the place of. */
export const withoutStarts = (scene: Scene): Scene => ({
  ...scene,
  actors: [],
  flows: [],
  goals: [],
  chosenGoal: null,
  hover: null,
  hoverText: null,
});

/** The plan of the editor's scenario at a chosen moment, drawn on the map. */
export function usePlannedView(
  now: EditorNow,
  wanted: boolean,
  /** Who is marked, and after whom a camera looks. */
  one: string | null,
  /** Another number each time that something else than before draws it. */
  shows: number,
): PlannedView {
  const { scenario, handle } = now;
  const [moment, setMoment] = useState<number | null>(null);
  const plan = usePlanned(scenario.name, scenario.version, wanted);
  const { planned } = plan;
  const idle = now.tool === null && now.pick.now === null;
  const shown = wanted && idle && moment !== null && planned !== null;
  useEffect(() => {
    if (!shown) return;
    const map = handle.current;
    map?.setMoving(planned.at(moment, one));
    return () => map?.setMoving(null);
  }, [handle, shown, planned, moment, one, shows]);
  return {
    plan,
    moment,
    setMoment,
    shown,
    hint:
      moment === null
        ? ""
        : t`Planned, not simulated, at ${clock(moment)}: each alone on the road, without lights or other traffic`,
    pick: ({ x, y, reach }) => {
      if (!planned || moment === null) return;
      const { count, pose } = planned.at(moment, null);
      let [best, least] = [-1, Math.max(reach, 3)];
      for (let k = 0; k < count; k++) {
        const away = Math.hypot(nth(pose, 5 * k) - x, nth(pose, 5 * k + 1) - y);
        if (away < least) [best, least] = [k, away];
      }
      now.select(best < 0 ? [] : [nth(planned.there(moment), best)]);
    },
  };
}
