import { create, type StoreApi, type UseBoundStore } from "zustand";

import { api, ApiError } from "../api/client";
import type { Edit, ScenarioDocument, ScenarioState } from "../api/types";
import { reasonOf } from "../ui/reason";
import { everyone } from "./placing";

export type Saving = "saved" | "saving" | "failed";

export interface EditorState {
  name: string;
  scenario: ScenarioState | null;
  saving: Saving;
  /** What went wrong last, in the server's words. */
  refusal: Refusal | null;
  /** Ids of road users and flows. */
  selection: readonly string[];
  load: () => Promise<void>;
  /**
   * Asks for a change, of one edit or of several that are one step for undo; the answer is the new
   * document, or null if it was refused.
   */
  edit: (edit: Edit | readonly Edit[], label?: string) => Promise<ScenarioState | null>;
  /** Asks for a change that is no edit; a refusal is thrown, for the caller to show. */
  take: (call: (version: number) => Promise<ScenarioState>) => Promise<ScenarioState>;
  /** Asks for a change that is no edit; the answer is null if it was refused, which is shown. */
  ask: (call: (version: number) => Promise<ScenarioState>) => Promise<ScenarioState | null>;
  undo: () => Promise<ScenarioState | null>;
  redo: () => Promise<ScenarioState | null>;
  select: (ids: readonly string[]) => void;
  clearRefusal: () => void;
}

/** A change that was not made; one that was not wrong in itself can be asked for again. */
export interface Refusal {
  title: string;
  message: string;
  again: (() => Promise<ScenarioState | null>) | null;
}

export type EditorStore = UseBoundStore<StoreApi<EditorState>>;

/** Who is selected after a change: the new ones, else those that are still there. */
export function selectionAfter(
  selection: readonly string[],
  before: ScenarioDocument,
  after: ScenarioDocument,
): readonly string[] {
  const old = new Set(everyone(before).map((one) => one.id));
  const now = everyone(after).map((one) => one.id);
  const fresh = now.filter((id) => !old.has(id));
  if (fresh.length > 0) return fresh;
  const there = new Set(now);
  return selection.every((id) => there.has(id)) ? selection : selection.filter((id) => there.has(id));
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
        selection: selectionAfter(selection, scenario?.document ?? next.document, next.document),
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
          await refused(error, () => ask(call));
          return null;
        }
      });
      queue = turn;
      return turn;
    };
    const take = (call: (version: number) => Promise<ScenarioState>): Promise<ScenarioState> => {
      const turn = queue.then(async () => {
        const { scenario } = get();
        if (!scenario) throw new Error("The scenario is not loaded yet.");
        set({ saving: "saving", refusal: null });
        try {
          const next = await call(scenario.version);
          accept(next);
          return next;
        } catch (error) {
          set({ saving: "saved" });
          if (!(error instanceof ApiError) || error.status !== 409) throw error;
          await get().load();
          throw new Error(
            "The scenario was changed in another tab. You now see its newest state; try again.",
          );
        }
      });
      queue = turn.catch(() => undefined);
      return turn;
    };
    const refused = async (error: unknown, again: Refusal["again"]): Promise<void> => {
      const status = error instanceof ApiError ? error.status : -1;
      const message = reasonOf(error);
      if (status === 409) {
        try {
          await get().load();
        } catch (failure) {
          set({
            saving: "failed",
            refusal: { title: "The scenario cannot be read", message: reasonOf(failure), again },
          });
          return;
        }
        const title = "Changed in another tab";
        set({
          refusal: {
            title,
            message: "You now see the newest state without your last change, which you can apply again.",
            again,
          },
        });
        return;
      }
      const failed = status <= 0 || status >= 500;
      set({
        saving: failed ? "failed" : "saved",
        refusal: {
          title: failed ? "Your last change is not saved" : "That is not possible",
          message,
          again: failed ? again : null,
        },
      });
    };
    return {
      name,
      scenario: null,
      saving: "saved",
      refusal: null,
      selection: [],
      load: async () => accept(await api.scenario(name)),
      edit: (edit, label) => {
        const edits = Array.isArray(edit) ? (edit as readonly Edit[]) : [edit as Edit];
        return ask((version) => api.edit(name, version, edits, label));
      },
      take,
      ask,
      undo: () => ask((version) => api.undo(name, version)),
      redo: () => ask((version) => api.redo(name, version)),
      select: (ids) => set({ selection: ids }),
      clearRefusal: () => set({ refusal: null }),
    };
  });
}
