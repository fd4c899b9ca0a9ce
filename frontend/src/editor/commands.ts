import { t } from "@lingui/core/macro";

import { CATEGORIES, type Category } from "../api/types";
import { CATEGORY_WORD, flowWord } from "../ui/words";
import type { Step } from "./scene";

/** Something that can be done from the search. */
export interface Command {
  id: string;
  label: string;
  /** The keys that do the same; empty without any. */
  keys: string;
  act: () => void;
}

/** What commands do. */
export interface Doings {
  run: () => void;
  undo: () => void;
  redo: () => void;
  openStep: (step: Step) => void;
  place: (category: Category) => void;
  placeFlow: (walks: boolean) => void;
  selectAll: () => void;
  showAll: () => void;
  showRegion: () => void;
  runs: () => void;
  studies: () => void;
  sweeps: () => void;
  catalogue: () => void;
  help: () => void;
  tour: () => void;
}

/** Every action of the editor by its name; `titles` are those of the steps. */
export function commandsOf(doings: Doings, titles: readonly (readonly [Step, string])[]): Command[] {
  const command = (id: string, label: string, act: () => void, keys = ""): Command => ({
    id,
    label,
    keys,
    act,
  });
  return [
    command("run", t`Run the scenario`, doings.run, t`Ctrl+Enter`),
    ...titles.map(([step, title]) => command(`step ${step}`, t`Open: ${title}`, () => doings.openStep(step))),
    ...CATEGORIES.map((category, n) =>
      command(
        `place ${category}`,
        t`Place: ${CATEGORY_WORD()[category]}`,
        () => doings.place(category),
        String(n + 1),
      ),
    ),
    ...[false, true].map((walks, n) =>
      command(
        `flow ${n}`,
        t`Place: ${flowWord(walks)}`,
        () => doings.placeFlow(walks),
        String(CATEGORIES.length + n + 1),
      ),
    ),
    command("undo", t`Undo`, doings.undo, t`Ctrl+Z`),
    command("redo", t`Redo`, doings.redo, t`Ctrl+Y`),
    command("select", t`Select all road users`, doings.selectAll, t`Ctrl+A`),
    command("all", t`Show the whole map`, doings.showAll),
    command("region", t`Show the region`, doings.showRegion),
    command("runs", t`Earlier runs`, doings.runs),
    command("sweeps", t`Sweeps`, doings.sweeps),
    command("studies", t`Studies and comparisons`, doings.studies),
    command("catalogue", t`Maps and scenarios`, doings.catalogue),
    command("help", t`Help: keyboard shortcuts and glossary`, doings.help, "?"),
    command("tour", t`Short tour`, doings.tour),
  ];
}

/** Commands whose name has every word of a search in it; all of them without one. */
export function findCommands(commands: readonly Command[], search: string): Command[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return commands.filter(({ label }) => words.every((word) => label.toLowerCase().includes(word)));
}
