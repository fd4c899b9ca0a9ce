import { create, type StoreApi, type UseBoundStore } from "zustand";

import { api, ApiError } from "../api/client";
import type { Actor, Edit, ScenarioState } from "../api/types";

export type Saving = "saved" | "saving" | "failed";

export interface EditorState {
  name: string;
  scenario: ScenarioState | null;
  saving: Saving;
  /** What went wrong last, in the server's words. */
  refusal: string | null;
  selection: readonly string[];
  load: () => Promise<void>;
  /** Asks for a change; the answer is the new document, or null if it was refused. */
  edit: (edit: Edit) => Promise<ScenarioState | null>;
  undo: () => Promise<ScenarioState | null>;
  redo: () => Promise<ScenarioState | null>;
  select: (ids: readonly string[]) => void;
  clearRefusal: () => void;
}

export type EditorStore = UseBoundStore<StoreApi<EditorState>>;

/** Ids of a selection that are still there. */
export const stillThere = (selection: readonly string[], actors: readonly Actor[]): string[] =>
  selection.filter((id) => actors.some((actor) => actor.id === id));

/** The actors that came with a change. */
export const added = (before: readonly Actor[], after: readonly Actor[]): string[] =>
  after.filter((actor) => !before.some((old) => old.id === actor.id)).map((actor) => actor.id);

/** Who is selected after a change: the new ones, else those that are still there. */
export function selectionAfter(
  selection: readonly string[], before: readonly Actor[], after: readonly Actor[],
): string[] {
  const fresh = added(before, after);
  return fresh.length > 0 ? fresh : stillThere(selection, after);
}

/** Holds one scenario as the server knows it; changes go out one at a time, in order. */
export function createEditorStore(name: string): EditorStore {
  let queue: Promise<unknown> = Promise.resolve();
  return create<EditorState>((set, get) => {
    const accept = (next: ScenarioState): void => {
      const { scenario, selection } = get();
      set({
        scenario: next,
        saving: "saved",
        selection: selectionAfter(
          selection, scenario?.document.actors ?? next.document.actors, next.document.actors),
      });
    };
    const ask = (call: (version: number) => Promise<ScenarioState>): Promise<ScenarioState | null> => {
      const turn = queue.then(async () => {
        const { scenario } = get();
        if (!scenario) return null;
        set({ saving: "saving", refusal: null });
        try {
          const next = await call(scenario.version);
          accept(next);
          return next;
        } catch (error) {
          await refused(error);
          return null;
        }
      });
      queue = turn;
      return turn;
    };
    const refused = async (error: unknown): Promise<void> => {
      const status = error instanceof ApiError ? error.status : -1;
      if (status === 409) {
        set({ refusal: "This scenario was changed in another tab. You now see the newest state; please repeat your last change." });
        await get().load();
        return;
      }
      set({
        saving: status === 0 || status >= 500 || status < 0 ? "failed" : "saved",
        refusal: error instanceof Error ? error.message : String(error),
      });
    };
    return {
      name,
      scenario: null,
      saving: "saved",
      refusal: null,
      selection: [],
      load: async () => accept(await api.scenario(name)),
      edit: (edit) => ask((version) => api.edit(name, version, edit)),
      undo: () => ask((version) => api.undo(name, version)),
      redo: () => ask((version) => api.redo(name, version)),
      select: (ids) => set({ selection: ids }),
      clearRefusal: () => set({ refusal: null }),
    };
  });
}
