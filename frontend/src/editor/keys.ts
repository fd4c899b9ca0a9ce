import { t } from "@lingui/core/macro";
import { useEffect, useRef } from "react";

import { localized } from "../language/localized";

export interface KeyActions {
  undo: () => void;
  redo: () => void;
  remove: () => void;
  escape: () => void;
  sheet: () => void;
  find: () => void;
  run: () => void;
  copy: () => void;
  move: () => void;
  paste: () => void;
  goal: () => void;
  waypoint: () => void;
  /** The next free point along the lane, or the one before. */
  along: (step: 1 | -1) => void;
  /** A free point of the next lane. */
  lane: () => void;
  selectAll: () => void;
  /** 1 to 7 a kind of road user, 8 and 9 a flow. */
  tool: (n: number) => void;
}

/** Shortcuts that hold everywhere but in fields and dialogs. */
export function useKeys(actions: KeyActions): void {
  const latest = useRef(actions);
  useEffect(() => {
    latest.current = actions;
  });
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (
        event.target instanceof Element &&
        event.target.closest("input, textarea, [role=dialog][aria-modal=true], [role=listbox], [role=menu]")
      )
        return;
      const act = actionOf(event, latest.current);
      if (!act) return;
      act();
      event.preventDefault();
    };
    addEventListener("keydown", onKey);
    return () => removeEventListener("keydown", onKey);
  }, []);
}

function actionOf(event: KeyboardEvent, actions: KeyActions): (() => void) | null {
  const key = event.key.toLowerCase();
  if (event.ctrlKey || event.metaKey) {
    // With text marked on the page, Ctrl+C copies that text.
    const marked = !getSelection()?.isCollapsed;
    const named: Record<string, () => void> = {
      z: event.shiftKey ? actions.redo : actions.undo,
      y: actions.redo,
      a: actions.selectAll,
      k: actions.find,
      enter: actions.run,
      v: actions.paste,
      ...(marked ? {} : { c: actions.copy }),
    };
    return named[key] ?? null;
  }
  if (event.altKey) return null;
  const plain: Record<string, () => void> = {
    delete: actions.remove,
    backspace: actions.remove,
    escape: actions.escape,
    "?": actions.sheet,
    m: actions.move,
    g: actions.goal,
    w: actions.waypoint,
    l: actions.lane,
    ".": () => actions.along(1),
    ",": () => actions.along(-1),
  };
  if (/^[1-9]$/.test(key)) return () => actions.tool(Number(key) - 1);
  return plain[key] ?? null;
}

export const SHORTCUTS = localized((): readonly (readonly [keys: string, what: string])[] => [
  [t`Ctrl+Z / Ctrl+Y`, t`Undo / redo`],
  [t`Ctrl+Enter`, t`Run the scenario`],
  [t`Ctrl+K`, t`Find a road, a junction or a road user, or do anything by its name`],
  ["1 – 7", t`Place a car, van, truck, bus, motorcycle, bicycle, pedestrian`],
  ["8 / 9", t`Place a vehicle flow / pedestrian flow`],
  [t`Ctrl+C`, t`Copy what is selected: then choose where`],
  [t`Ctrl+V`, t`Place what was copied once more`],
  ["M", t`Move what is selected: then choose where`],
  [", / .", t`Move the start of what is selected back or on along its lane`],
  ["L", t`Move the start of what is selected to another lane`],
  ["G", t`Choose the goal of what is selected on the map`],
  ["W", t`Add a waypoint to the route of what is selected`],
  [t`Drag`, t`Move road users, the flag of a goal, or the route through another place`],
  [t`Ctrl+A`, t`Select all`],
  [t`Shift + click`, t`Select several`],
  [t`Shift + drag`, t`Select all in a rectangle`],
  [t`Ctrl + drag`, t`Select all inside a line that is drawn`],
  [t`Delete`, t`Remove what is selected`],
  ["Escape", t`Stop placing, clear the selection`],
  [t`Arrow keys`, t`On the map: move it (with Shift: a little)`],
  ["+ / −", t`On the map: zoom`],
  ["0", t`On the map: show everything`],
  ["Enter", t`On the map: choose what is in the middle`],
  ["R", t`On the map: measure (Backspace takes a point back, Escape ends)`],
  ["↑ / ↓", t`In the table: the row before or after`],
  ["← / →", t`In the time bar: move a block by 1 s (with Shift 10 s, with Alt 0.1 s)`],
  ["?", t`This help`],
]);
