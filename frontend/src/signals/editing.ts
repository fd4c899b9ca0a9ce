import type { TimedSignals } from "../api/signals";
import { signals } from "../api/signals";
import type { Edit, ScenarioDocument, ScenarioState } from "../api/types";
import { api } from "../api/client";
import type { PlacePick } from "../editor/pick";
import type { EditorStore } from "../editor/store";
import { reasonOf } from "../ui/reason";
import type { Grip } from "./ring";

export type Timing = ScenarioDocument["signals"]["junctions"][number];
export type LightControl = ScenarioDocument["signals"]["control"];
/** What came of timing lights: sentences, and a picture or nothing. */
export type TimingResult = Omit<TimedSignals, "state">;

/** What the panel of a light can ask for; what is refused is said by the editor. */
export interface SignalEditing {
  name: string;
  /** What the scenario says of the light. */
  timing: Timing | null;
  /** Control of lights that have none of their own. */
  control: LightControl;
  /** Answers whether it was done, as all of these. */
  edit: (edit: Edit, label?: string) => Promise<boolean>;
  /** Asks for edits that are one step for undo; the answer is why they were refused, for the field to say. */
  attempt: (edits: readonly Edit[], label?: string) => Promise<string | null>;
  /** Places that are picked on the map. */
  pick: PlacePick;
  retime: (grip: Grip, seconds: number, plan: string | null, keepCycle: boolean) => Promise<boolean>;
  takeOver: () => Promise<boolean>;
  /** What came of it; null if it was refused. */
  time: (call: (version: number) => Promise<TimedSignals>) => Promise<TimingResult | null>;
}

/** The changes that can be made to the light of a junction, all names of which are `names`. */
export function signalEditing(
  store: EditorStore,
  { name, document }: ScenarioState,
  junction: string,
  names: readonly string[],
  pick: PlacePick,
): SignalEditing {
  const { edit: change, ask, take } = store.getState();
  const edit: SignalEditing["edit"] = async (one, label) => (await change(one, label)) !== null;
  const made = async (call: (version: number) => Promise<ScenarioState>): Promise<boolean> =>
    (await ask(call)) !== null;
  return {
    name,
    timing: document.signals.junctions.find((one) => names.includes(one.junction)) ?? null,
    control: document.signals.control,
    edit,
    attempt: async (edits, label) => {
      try {
        await take((version) => api.edit(name, version, edits, label));
        return null;
      } catch (error) {
        return reasonOf(error);
      }
    },
    pick,
    retime: (grip, seconds, plan, keepCycle) => {
      if (grip.is === "cycle")
        return made((version) => signals.setCycle(name, version, junction, seconds, plan));
      if (grip.is === "offset") return edit({ kind: "set_offset", junction, offset: seconds, plan });
      const { stage } = grip;
      return edit({ kind: "set_green", junction, stage, green: seconds, plan, keep_cycle: keepCycle });
    },
    takeOver: () => made((version) => signals.takeOver(name, version, junction)),
    time: async (call) => {
      let result: TimingResult | null = null;
      const done = await made(async (version) => {
        const { state, ...rest } = await call(version);
        result = rest;
        return state;
      });
      return done ? result : null;
    },
  };
}
