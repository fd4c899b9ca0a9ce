import type { Actor, Edit, Flow } from "../api/types";
import type { Place } from "../map/graph";
import { tell } from "../ui/notices";
import { count } from "../ui/words";
import { isFlow, type Starts, type Tool } from "./placing";
import type { EditorStore } from "./store";

const STREAM_PER_HOUR = 300;

/** What can be done to road users and streams, as edits that the server is asked for. */
export function useChanges(store: EditorStore, ones: readonly (Actor | Flow)[], starts: Starts) {
  const { edit } = store();
  const change = (asked: Edit | readonly Edit[], label?: string): void => { void edit(asked, label); };
  const among = (ids: readonly string[]): (Actor | Flow)[] => {
    const wanted = new Set(ids);
    return ones.filter((one) => wanted.has(one.id));
  };
  const startOf = (one: Actor | Flow, spawn: string): Edit => isFlow(one)
    ? { kind: "change_flow", flow: one.id, spawn } : { kind: "move_actor", actor: one.id, spawn };
  const leftOut = (asked: number, found: number): void => {
    if (found < asked) tell(`${count(asked - found, "road user")} found no free point there and ${asked - found === 1 ? "was" : "were"} left out.`);
  };

  return {
    change,
    setStart: (one: Actor | Flow, spawn: string) => change(startOf(one, spawn)),
    setGoal: (one: Actor | Flow, goal: string | null) => change(isFlow(one)
      ? { kind: "change_flow", flow: one.id, goal } : { kind: "set_goal", actor: one.id, goal }),
    remove: (ids: readonly string[]) => {
      const gone = among(ids);
      const actors = gone.filter((one) => !isFlow(one)).map((one) => one.id);
      const edits: Edit[] = gone.filter(isFlow).map((one) => ({ kind: "remove_flow", flow: one.id }));
      if (actors.length > 0) edits.unshift({ kind: "remove_actors", actors });
      if (edits.length > 0) change(edits, gone.length === 1 ? `Remove ${gone[0]?.id}` : `Remove ${gone.length} road users`);
    },
    /** Uses a tool at a place; whether it is used up then. */
    use: (tool: Tool, to: Place): boolean => {
      if (tool.does === "place") change({ kind: "add_actor", category: tool.category, spawn: to.id });
      else if (tool.does === "stream") {
        const mix = tool.walk ? { pedestrian: 1 } : { car: 1 };
        change({ kind: "add_flow", spawn: to.id, per_hour: STREAM_PER_HOUR, mix });
      } else {
        const moved = among(tool.ids);
        const moves = starts.shifted(moved, to);
        leftOut(moved.length, moves.length);
        const word = tool.does === "copy" ? "Copy" : "Move";
        const label = moved.length === 1 ? `${word} ${moved[0]?.id}` : `${word} ${moves.length} road users`;
        if (moves.length === 0) return true;
        if (tool.does === "copy") {
          change({ kind: "copy_actors", copies: Object.fromEntries(moves.map(([id, spawn]) => [spawn, id])) }, label);
        } else {
          const spawns = new Map(moves);
          change(moved.flatMap((one) => { const spawn = spawns.get(one.id); return spawn ? [startOf(one, spawn)] : []; }), label);
        }
        return true;
      }
      return false;
    },
    fill: async (share: number, seed: number): Promise<void> => {
      const done = await edit({ kind: "fill_roi", share, seed });
      if (!done) return;
      store.getState().select([]);
      tell(`${count(done.document.actors.length, "road user")} placed. Undo brings back what was there.`);
    },
  };
}
