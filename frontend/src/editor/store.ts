import { t } from "@lingui/core/macro";
import { create, type StoreApi, type UseBoundStore } from "zustand";

import { api, ApiError } from "../api/client";
import type { Edit, ScenarioPatch, ScenarioDocument, ScenarioState } from "../api/types";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { patched, reused } from "./documentChanges";
import { foreseen } from "./foreseen";
import { everyone } from "./placing";
import { Timeline } from "./timeline";

export type Saving = "saved" | "saving" | "failed";
/** A scenario as it is now, or what has changed of it. */
type Answer = ScenarioState | ScenarioPatch;
type Ask<A> = (call: (version: number) => Promise<A>) => Promise<ScenarioState | null>;

export interface EditorState {
  name: string;
  /** As the server knows it, with what is on its way there and can be foreseen. */
  scenario: ScenarioState | null;
  /** The document that the problems of `scenario` are about: the newest, or one before it. */
  checked: ScenarioDocument | null;
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
  take: (call: (version: number) => Promise<Answer>) => Promise<ScenarioState>;
  /** Asks for a change that is no edit; the answer is null if it was refused, which is shown. */
  ask: Ask<ScenarioState>;
  undo: () => Promise<ScenarioState | null>;
  redo: () => Promise<ScenarioState | null>;
  select: (ids: readonly string[]) => void;
  clearRefusal: () => void;
}

type Again = () => Promise<ScenarioState | null>;
/** Changes that were not made; those that were not wrong in themselves can be asked for again. */
export interface Refusal {
  title: string;
  message: string;
  again: Again | null;
}

export type EditorStore = UseBoundStore<StoreApi<EditorState>>;

/** A change that the server has not answered yet. */
interface Pending {
  /** Steps of undo (-1) or redo (+1); an edit is none. */
  step: -1 | 0 | 1;
  /** What it will make of a document; null if only the server knows. */
  foresee: (document: ScenarioDocument) => ScenarioDocument | null;
}

const UNKNOWN: Pending = { step: 0, foresee: () => null };
/** Milliseconds without a change after which problems are asked for: checking holds up the next one. */
const CHECK_AFTER = 100;

/** Who is selected after a change: the new ones, else those that are still there. */
export function selectionAfter(
  selection: readonly string[],
  before: ScenarioDocument,
  after: ScenarioDocument,
): readonly string[] {
  if (before === after) return selection;
  const old = new Set(everyone(before).map((one) => one.id));
  const now = everyone(after).map((one) => one.id);
  const fresh = now.filter((id) => !old.has(id));
  if (fresh.length > 0) return fresh;
  const there = new Set(now);
  return selection.every((id) => there.has(id)) ? selection : selection.filter((id) => there.has(id));
}

/**
 * Holds one scenario as the server knows it; changes go out one at a time, in order. What they will
 * do is shown before the answer where it can be foreseen, and taken back if it is refused.
 */
export function createEditorStore(name: string): EditorStore {
  let queue: Promise<unknown> = Promise.resolve();
  /** As the server has answered last. */
  let known: ScenarioState | null = null;
  let pending: readonly Pending[] = [];
  /** What was not made for want of a server or of the newest state, in order; it waits for its user. */
  let unsent: readonly { again: Again; lost: boolean }[] = [];
  let check: ReturnType<typeof setTimeout> | undefined;
  const timeline = new Timeline();
  return create<EditorState>((set, get) => {
    /** Shows what is known, with what is on its way. */
    const show = (more: Partial<EditorState> = {}): void => {
      if (!known) return;
      const { scenario, selection } = get();
      const shown = scenario?.document ?? known.document;
      const made = pending.reduce((one, { foresee }) => foresee(one) ?? one, known.document);
      const document = pending.length > 0 ? reused(shown, made) : made;
      set({
        scenario: document === known.document ? known : { ...known, document },
        selection: selectionAfter(selection, shown, document),
        ...more,
      });
    };
    /** The problems as they are now, unless something changes meanwhile, after which it is asked again. */
    const checkSoon = (): void => {
      clearTimeout(check);
      check = setTimeout(() => {
        const asked = known;
        void api.problems(name).then(
          ({ version, problems }) => {
            if (!asked || known !== asked || version !== asked.version) return;
            const same = reused(asked.problems, problems) === asked.problems;
            // Places are rows of lists: those of another document are others.
            if (!same || problems.length > 0) known = { ...asked, problems };
            show({ checked: asked.document });
          },
          () => undefined, // The next change asks again, and says if there is no server.
        );
      }, CHECK_AFTER);
    };
    /** What the server has answered; null if it does not follow on what is known. */
    const accept = (answer: Answer, step: Pending["step"]): ScenarioState | null => {
      const whole = "document" in answer;
      if (!known || (!whole && known.version !== answer.before)) return null;
      const made = whole ? answer.document : patched(known.document, answer.changes);
      const document = reused(get().scenario?.document ?? made, made);
      const { version, label, undo, redo } = answer;
      if (step !== 0) timeline.move(step, document);
      else if (version !== known.version) timeline.grow(document);
      const problems = whole ? answer.problems : known.problems;
      known = { ...known, name: answer.name, document, problems, version, label, undo, redo };
      show({ saving: stateOf(), ...(whole && { checked: document }) });
      if (!whole) checkSoon();
      return known;
    };
    /** One change: shown if it can be foreseen, and sent when those before it are answered. */
    const turn = <T>(
      one: Pending,
      call: (version: number) => Promise<Answer>,
      failed: (error: unknown) => Promise<T>,
    ): Promise<ScenarioState | T | null> => {
      pending = [...pending, one];
      clearTimeout(check);
      show({ saving: "saving", ...calm() });
      const done = (): void => {
        pending = pending.filter((other) => other !== one);
      };
      const made = queue.then(async () => {
        if (!known) {
          done();
          return null;
        }
        const { saving, refusal } = get();
        if (saving !== "saving" || refusal) set({ saving: "saving", ...calm() });
        try {
          const answer = await call(known.version);
          done();
          const next = accept(answer, one.step);
          if (!next) await get().load();
          return next ?? known;
        } catch (error) {
          done();
          show();
          return await failed(error);
        }
      });
      queue = made.catch(() => undefined);
      return made;
    };
    const send = (one: Pending, call: (version: number) => Promise<Answer>): Promise<ScenarioState | null> =>
      turn<null>(one, call, async (error) => {
        await refused(error, () => send({ ...one }, call));
        return null;
      });
    const move = (
      step: -1 | 1,
      call: (version: number) => Promise<Answer>,
    ): Promise<ScenarioState | null> => {
      const moves = pending.every((one) => one.step !== 0);
      const steps = pending.reduce<number>((sum, one) => sum + one.step, step);
      const there = moves ? timeline.look(steps) : null;
      return send({ step, foresee: () => there }, call);
    };
    const ask: Ask<ScenarioState> = (call) => send({ ...UNKNOWN }, call);
    const take: EditorState["take"] = async (call) => {
      const found = await turn<never>({ ...UNKNOWN }, call, async (error) => {
        set({ saving: stateOf() });
        if (!(error instanceof ApiError) || error.status !== 409) throw error;
        await get().load();
        throw new Error(t`The scenario was changed in another tab. You now see its newest state; try again.`);
      });
      if (!found) throw new Error(t`The scenario is not loaded yet.`);
      return found;
    };
    /** Whether the server has all that its user made; one who lost to another tab has seen that. */
    const stateOf = (): Saving => (unsent.some((one) => one.lost) ? "failed" : "saved");
    /** What is said stays as long as something waits to be made again. */
    const calm = (): { refusal?: null } => (unsent.length > 0 ? {} : { refusal: null });
    /** Keeps a change for later; what is returned makes all that are kept, in their order. */
    const later = (again: Again, { lost }: { lost: boolean }): Again => {
      unsent = [...unsent, { again, lost }];
      return async () => {
        const all = unsent;
        unsent = [];
        return (await Promise.all(all.map((one) => one.again()))).at(-1) ?? null;
      };
    };
    const refused = async (error: unknown, again: Again): Promise<void> => {
      const status = error instanceof ApiError ? error.status : -1;
      const message = reasonOf(error);
      if (status === 409) {
        try {
          await get().load();
        } catch (failure) {
          set({
            saving: "failed",
            refusal: {
              title: t`The scenario cannot be read`,
              message: reasonOf(failure),
              again: later(again, { lost: true }),
            },
          });
          return;
        }
        const title = t`Changed in another tab`;
        set({
          refusal: {
            title,
            message: t`You now see the newest state without your last change, which you can apply again.`,
            again: later(again, { lost: false }),
          },
        });
        return;
      }
      // What was removed can be brought back.
      const failed = status <= 0 || status >= 500 || status === 404;
      const all = failed ? later(again, { lost: true }) : null;
      // One that can never be made does not push out those that wait.
      if (unsent.length > 0 && !failed) {
        set({ saving: stateOf() });
        return tell(t`That is not possible: ${message}`);
      }
      const title =
        unsent.length > 1
          ? t`Your last ${unsent.length} changes are not saved`
          : failed
            ? t`Your last change is not saved`
            : t`That is not possible`;
      set({ saving: failed ? "failed" : "saved", refusal: { title, message, again: all } });
    };
    return {
      name,
      scenario: null,
      checked: null,
      saving: "saved",
      refusal: null,
      selection: [],
      load: async () => {
        const answer = await api.scenario(name);
        const shown = get().scenario?.document ?? answer.document;
        known = { ...answer, document: reused(shown, answer.document) };
        timeline.begin(known.document);
        show({ saving: stateOf(), checked: known.document });
      },
      edit: (edit, label) => {
        const edits = Array.isArray(edit) ? (edit as readonly Edit[]) : [edit as Edit];
        const foresee: Pending["foresee"] = (document) => foreseen(document, edits);
        return send({ step: 0, foresee }, (version) => api.edit(name, version, edits, label));
      },
      take,
      ask,
      undo: () => move(-1, (version) => api.undo(name, version)),
      redo: () => move(1, (version) => api.redo(name, version)),
      select: (ids) => set({ selection: ids }),
      clearRefusal: () => {
        unsent = [];
        set({ saving: "saved", refusal: null });
      },
    };
  });
}

let last: EditorStore | null = null;

/** The store of a scenario: a new one, or that of the last editor if changes of it wait to be made again. */
export function editorStoreOf(name: string): EditorStore {
  const waiting = last?.getState().name === name && last.getState().refusal?.again;
  if (!last || !waiting) last = createEditorStore(name);
  return last;
}
