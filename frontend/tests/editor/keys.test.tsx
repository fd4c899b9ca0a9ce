// @vitest-environment happy-dom
import { renderHook } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, expect, test, vi } from "vitest";

import { type KeyActions, useKeys } from "../../src/editor/keys";

afterEach(() => {
  document.body.replaceChildren();
});

function listening() {
  const actions = {
    undo: vi.fn(),
    redo: vi.fn(),
    remove: vi.fn(),
    escape: vi.fn(),
    sheet: vi.fn(),
    find: vi.fn(),
    run: vi.fn(),
    copy: vi.fn(),
    move: vi.fn(),
    paste: vi.fn(),
    goal: vi.fn(),
    waypoint: vi.fn(),
    along: vi.fn(),
    lane: vi.fn(),
    selectAll: vi.fn(),
    tool: vi.fn(),
  } satisfies KeyActions;
  const { unmount } = renderHook(() => useKeys(actions));
  return { actions, unmount, user: userEvent.setup() };
}

test("shortcuts do what the help says", async () => {
  const { actions, user, unmount } = listening();
  await user.keyboard("{Control>}zyacvk{Enter}{/Control}{Delete}{Escape}?mgwl,.19");
  const { tool, along, ...others } = actions;
  for (const [name, act] of Object.entries(others)) expect(act, name).toHaveBeenCalledOnce();
  expect(along.mock.calls).toEqual([[-1], [1]]);
  expect(tool.mock.calls).toEqual([[0], [8]]);
  unmount();
});

test("keys that are typed into a field, or into a dialog, are left to it", async () => {
  const { actions, user, unmount } = listening();
  document.body.innerHTML = "<input><div role=dialog aria-modal=true><button>x</button></div>";
  document.querySelector("input")?.focus();
  await user.keyboard("1m{Delete}");
  document.querySelector("button")?.focus();
  await user.keyboard("{Escape}");
  for (const act of Object.values(actions)) expect(act).not.toHaveBeenCalled();
  unmount();
});
