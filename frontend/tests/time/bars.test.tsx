// @vitest-environment happy-dom
import { fireEvent, screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { Incident } from "../../src/api/runs";
import { BlockRow } from "../../src/time/BlockRow";
import type { Block, Times } from "../../src/time/blocks";
import { RunBar } from "../../src/time/RunBar";
import { show } from "../page";

const SIGHT = { begin: 0, seconds: 100, width: 500 };
const FLOW: Block = {
  kind: "flow",
  id: "f",
  word: "Vehicle flow",
  begin: 10,
  end: 60,
  ends: true,
  until: 60,
  category: null,
};

function row(block: Block) {
  const calls = { hold: vi.fn(), drop: vi.fn(), putBack: vi.fn(), nudge: vi.fn(), onChoose: vi.fn() };
  const { onChoose, ...moves } = calls;
  const timesOf = ({ begin, end }: Times): Times => ({ begin, end });
  show(
    <BlockRow
      block={block}
      sight={SIGHT}
      longest={600}
      retiming={{ ...moves, timesOf }}
      onChoose={onChoose}
    />,
  );
  return calls;
}

test("a drag moves a block in round steps, and is a change when it is put down", () => {
  const calls = row(FLOW);
  const block = screen.getByRole("slider", { name: "Time of flow f" });
  fireEvent.pointerDown(block, { pointerId: 1, button: 0, clientX: 100 });
  fireEvent.pointerMove(block, { pointerId: 1, clientX: 102 });
  expect(calls.hold).not.toHaveBeenCalled();
  // 60 pixels are 12 s.
  fireEvent.pointerMove(block, { pointerId: 1, clientX: 160 });
  expect(calls.hold).toHaveBeenLastCalledWith(FLOW, "all", 12);
  fireEvent.pointerUp(block, { pointerId: 1 });
  expect(calls.drop).toHaveBeenCalledOnce();
  expect(calls.onChoose).not.toHaveBeenCalled();
});

test("arrow keys move a block or one of its ends; Enter chooses it", () => {
  const calls = row(FLOW);
  const press = (name: string, init: object): void =>
    void fireEvent.keyDown(screen.getByRole("slider", { name }), init);
  press("Time of flow f", { key: "ArrowRight" });
  press("End of flow f", { key: "ArrowLeft", shiftKey: true });
  press("Begin of flow f", { key: "ArrowRight", altKey: true });
  expect(calls.nudge.mock.calls.map((call: unknown[]) => call.slice(1))).toEqual([
    ["all", 1],
    ["end", -10],
    ["begin", 0.1],
  ]);
  press("Time of flow f", { key: "Enter" });
  expect(calls.onChoose).toHaveBeenCalledOnce();
  const end = screen.getByRole("slider", { name: "End of flow f" });
  expect(end.getAttribute("aria-valuenow")).toBe("60");
  expect(end.getAttribute("aria-valuetext")).toBe("0:10.0 to 1:00.0");
});

const FIRED: Incident[] = [
  { time: 15, kind: "rule_started", actor: "car-1", rule: "brakes" },
  { time: 40, kind: "collision", actor: "car-1", partner: "van-2" },
];

function bar(time: number, live = false) {
  const calls = { onSeek: vi.fn(), onShow: vi.fn() };
  return {
    ...calls,
    ...show(
      <RunBar
        end={100}
        reached={100}
        time={time}
        incidents={FIRED}
        categories={new Map()}
        junction="j1"
        plans={[]}
        history={{ times: [0, 30], states: ["Gr", "rG"] }}
        ttc={{ ego: "car-1", points: [{ time: 15, ttc: 2.04, other: "van-2" }], learn: () => undefined }}
        spacing={0.5}
        first={null}
        onSeek={live ? null : calls.onSeek}
        onShow={calls.onShow}
      />,
    ),
  };
}

test("the bar of a run says what is now, and its buttons jump to the events", async () => {
  const { user, onSeek, onShow } = bar(15);
  expect(screen.getByRole("status").textContent).toContain("0:15.0 car-1 triggered rule brakes");
  expect(screen.getByText("car-1: 2.0 s to van-2")).toBeTruthy();
  expect(screen.getByText("1 green, 1 red")).toBeTruthy();
  expect(screen.getByRole("button", { name: "Event before" }).hasAttribute("disabled")).toBe(true);
  await user.click(screen.getByRole("button", { name: "Next event" }));
  expect(onSeek).toHaveBeenLastCalledWith(40);
  expect(onShow).toHaveBeenLastCalledWith(FIRED[1]);
});

test("a click jumps to the event that is there, or else to the instant", () => {
  const { onSeek } = bar(0);
  const rules = screen.getByText("Rules").closest(".time-row");
  if (!rules) throw new Error("no row");
  // Nothing is laid out here: 600 pixels are 100 s.
  fireEvent.click(rules, { clientX: 92 });
  expect(onSeek).toHaveBeenLastCalledWith(15);
  fireEvent.click(rules, { clientX: 300 });
  expect(onSeek).toHaveBeenLastCalledWith(50);
});

test("a live run has the same bar, in which nothing can be chosen", () => {
  bar(15, true);
  expect(screen.queryByRole("button", { name: "Next event" })).toBeNull();
  expect(screen.getByText("1 green, 1 red")).toBeTruthy();
});

test("the bar of a run shows less time by its buttons, and what is shown stays in sight", async () => {
  const { user, again, onSeek } = bar(50);
  const part = (time: number) => (
    <RunBar
      end={100}
      reached={100}
      time={time}
      incidents={FIRED}
      categories={new Map()}
      junction={null}
      plans={[]}
      history={null}
      ttc={{ ego: null, points: [], learn: () => undefined }}
      spacing={0.5}
      first={null}
      onSeek={onSeek}
      onShow={vi.fn()}
    />
  );
  const rules = (): Element => screen.getByText("Rules").closest(".time-row") as Element;
  await user.click(screen.getByRole("button", { name: "Show less time" }));
  // 25 to 75 s in 600 pixels.
  fireEvent.click(rules(), { clientX: 300 });
  expect(onSeek).toHaveBeenLastCalledWith(50);
  fireEvent.click(rules(), { clientX: 12 });
  expect(onSeek).toHaveBeenLastCalledWith(26);
  again(part(80));
  // 50 s are in sight, a tenth of them before 80 s if there were so much left.
  fireEvent.click(rules(), { clientX: 12 });
  expect(onSeek).toHaveBeenLastCalledWith(51);
  await user.click(screen.getByRole("button", { name: "Show the whole run" }));
  fireEvent.click(rules(), { clientX: 300 });
  expect(onSeek).toHaveBeenLastCalledWith(50);
});
