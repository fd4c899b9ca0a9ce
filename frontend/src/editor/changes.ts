import { plural, t } from "@lingui/core/macro";

import type { Chosen } from "../api/models";
import type { Actor, Category, Edit, Flow, ScenarioDocument, ScenarioState } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { extension } from "./regions";
import { type AskedRemoval, type Uses, usesOf } from "./uses";
import { isFlow, type Moves, type Starts } from "./placing";

/** Volume of a new flow. */
const PER_HOUR = 300;

export interface Changes {
  change: (edit: Edit | readonly Edit[], label?: string) => void;
  /** Gives something other times; whether that was possible. */
  retime: (edit: Edit, label: string) => Promise<boolean>;
  place: (category: Category, to: Place) => void;
  placeFlow: (walks: boolean, to: Place) => void;
  /** Copies road users so that the first starts at `to`; the others keep their distances. */
  copy: (ids: readonly string[], to: Place) => void;
  move: (ids: readonly string[], to: Place) => void;
  /**
   * Removes road users, and rules and criteria if they are given; where some are used by such and none
   * are given, it is asked first.
   */
  remove: (ids: readonly string[], withUses?: Uses) => void;
  setStart: (one: Actor | Flow, spawn: string) => void;
  setGoal: (one: Actor | Flow, goal: string | null) => void;
  /** Adds segments to the region: those that hang together with it. */
  extendRegion: (rows: readonly number[]) => void;
  /** Random road users, or those of a generator, in the place of all; whether they were placed. */
  fill: (share: number, seed: number, filler: Chosen | null) => Promise<boolean>;
}

/** What can be done to road users and flows, as edits that the server is asked for. */
export function changesOf({
  graph,
  document,
  roi,
  ones,
  starts,
  edit,
  say,
  ask,
}: {
  graph: Graph;
  document: Pick<ScenarioDocument, "rules" | "criteria">;
  roi: readonly string[];
  ones: readonly (Actor | Flow)[];
  starts: Starts;
  edit: (edit: Edit | readonly Edit[], label?: string) => Promise<ScenarioState | null>;
  say: (text: string) => void;
  /** Asks what is to become of rules and criteria. */
  ask: (removal: AskedRemoval) => void;
}): Changes {
  const change = (asked: Edit | readonly Edit[], label?: string): void => {
    void edit(asked, label);
  };
  const among = (ids: readonly string[]): (Actor | Flow)[] => {
    const known = new Map(ones.map((one) => [one.id, one]));
    // In the order of the ids: the first leads.
    return ids.flatMap((id) => known.get(id) ?? []);
  };
  const shifted = (moved: readonly (Actor | Flow)[], to: Place, move: boolean): Moves => {
    const moves = starts.shifted(moved, to, move);
    const left = moved.length - moves.length;
    if (left > 0)
      say(
        plural(left, {
          one: "# road user found no free point in the region and was left out.",
          other: "# road users found no free point in the region and were left out.",
        }),
      );
    return moves;
  };
  return {
    change,
    retime: async (asked, label) => (await edit(asked, label)) !== null,
    place: (category, to) => change({ kind: "add_actor", category, spawn: to.id }),
    placeFlow: (walks, to) =>
      change({
        kind: "add_flow",
        spawn: to.id,
        per_hour: PER_HOUR,
        mix: walks ? { pedestrian: 1 } : { car: 1 },
      }),
    copy: (ids, to) => {
      const copied = among(ids);
      const moves = shifted(copied, to, false);
      if (moves.length === 0) return;
      const copies = Object.fromEntries(moves.map(([id, spawn]) => [spawn, id]));
      change({ kind: "copy_actors", copies }, labelOf(t`Copy`, copied, moves.length));
    },
    move: (ids, to) => {
      const moved = among(ids);
      const moves = shifted(moved, to, true);
      if (moves.length === 0) return;
      const spawns = new Map(moves);
      const edits = moved.flatMap((one) => {
        const spawn = spawns.get(one.id);
        return spawn ? [startOf(one, spawn)] : [];
      });
      change(edits, labelOf(t`Move`, moved, moves.length));
    },
    remove: (ids, withUses) => {
      const gone = among(ids);
      const uses = withUses ?? usesOf(document, ids);
      if (withUses === undefined && (uses.rules.length > 0 || uses.criteria.length > 0)) {
        ask({ ids, uses });
        return;
      }
      const actors = gone.filter((one) => !isFlow(one)).map((one) => one.id);
      const edits: Edit[] = gone.filter(isFlow).map((one) => ({ kind: "remove_flow", flow: one.id }));
      if (actors.length > 0) edits.unshift({ kind: "remove_actors", actors });
      edits.push(...uses.rules.map((rule): Edit => ({ kind: "remove_rule", rule })));
      if (uses.criteria.length > 0) {
        const criteria = document.criteria.filter((_, n) => !uses.criteria.includes(n));
        edits.push({ kind: "set_criteria", criteria });
      }
      if (edits.length > 0) change(edits, labelOf(t`Remove`, gone, gone.length));
    },
    setStart: (one, spawn) => change(startOf(one, spawn)),
    setGoal: (one, goal) =>
      change(
        isFlow(one) ? { kind: "change_flow", flow: one.id, goal } : { kind: "set_goal", actor: one.id, goal },
      ),
    extendRegion: (rows) => {
      const { segments, left } = extension(graph, roi, rows);
      if (segments.length === 0) {
        say(
          left > 0
            ? t`These segments are not connected to the region. Add those between first.`
            : t`There is nothing to add here: no segment lies in it, or all are in the region.`,
        );
        return;
      }
      change(
        { kind: "extend_roi", segments },
        t`Add ${plural(segments.length, { one: "# segment", other: "# segments" })}`,
      );
      if (left > 0)
        say(
          plural(left, {
            one: "# segment is not connected to the rest and was skipped.",
            other: "# segments are not connected to the rest and were skipped.",
          }),
        );
    },
    fill: async (share, seed, filler) => {
      const done = await edit({
        kind: "fill_roi",
        share,
        seed,
        ...(filler && { generator: filler.name, options: filler.options }),
      });
      if (done)
        say(
          t`${plural(done.document.actors.length, { one: "# road user", other: "# road users" })} placed. Undo restores the previous ones.`,
        );
      return done !== null;
    },
  };
}

const startOf = (one: Actor | Flow, spawn: string): Edit =>
  isFlow(one) ? { kind: "change_flow", flow: one.id, spawn } : { kind: "move_actor", actor: one.id, spawn };

/** What undo says of it: one by its name, several by their number. */
const labelOf = (verb: string, ones: readonly (Actor | Flow)[], number: number): string =>
  ones.length === 1 ? `${verb} ${ones[0]?.id}` : t`${verb} ${number} road users`;
