// @vitest-environment happy-dom
import { fireEvent, screen, waitFor } from "@testing-library/react";
import { afterEach, expect, test, vi } from "vitest";

import { type Grip, beginOf, dragged, ringOf } from "../../src/signals/ring";
import { type Retime, RingBar } from "../../src/signals/RingBar";
import { show } from "../page";
import { plan } from "./program";

const ring = ringOf(plan);
const first: Grip = { is: "green", stage: "1" };

afterEach(() => vi.restoreAllMocks());

test("a ring is the greens of a plan and what is between them", () => {
  expect(ring).toEqual({
    parts: [
      { stage: "1", green: 15, between: 5, onCall: false },
      { stage: "2", green: 15, between: 5, onCall: true },
    ],
    cycle: 40,
    offset: 5,
  });
  expect(beginOf(ring, 1)).toBe(20);
});

test("a longer green makes the cycle longer, or takes from the next stage that always comes", () => {
  const longer = dragged(ring, first, 20, false);
  expect([longer.cycle, longer.parts.map(({ green }) => green)]).toEqual([45, [20, 15]]);
  const always = { ...ring, parts: ring.parts.map((one) => ({ ...one, onCall: false })) };
  const kept = dragged(always, first, 20, true);
  expect([kept.cycle, kept.parts.map(({ green }) => green)]).toEqual([40, [20, 10]]);
});

test("another cycle stretches the greens alone, and an offset stays in the cycle", () => {
  const longer = dragged(ring, { is: "cycle" }, 50, false);
  expect(longer.parts.map(({ green, between }) => [green, between])).toEqual([
    [20, 5],
    [20, 5],
  ]);
  expect(dragged(ring, { is: "offset" }, 43, false).offset).toBe(3);
});

/** The bar, 500 pixels wide: 40 s and a quarter more are 50 s. */
const bar = (onChange: Retime) => {
  vi.spyOn(HTMLElement.prototype, "getBoundingClientRect").mockReturnValue(new DOMRect(0, 0, 500, 40));
  HTMLElement.prototype.setPointerCapture = vi.fn();
  return show(<RingBar plan={plan} keepCycle={false} onChange={onChange} />);
};
const handle = (name: string) => screen.getByRole("slider", { name });

test("an end is dragged by as many seconds as pixels say, and asked for when it is let go", async () => {
  const asked = vi.fn<Retime>(() => Promise.resolve(true));
  bar(asked);
  const grip = handle("Green of stage 1");
  expect(grip.getAttribute("aria-valuetext")).toBe("15 s");
  fireEvent.pointerDown(grip, { clientX: 150, button: 0, pointerId: 1 });
  fireEvent.pointerMove(grip, { clientX: 202, pointerId: 1 });
  expect(grip.getAttribute("aria-valuenow")).toBe("20");
  expect(screen.getByText("Green of stage 1: 20 s")).toBeTruthy();
  expect(handle("Cycle").style.left).toBe("90.000%");
  expect(asked).not.toHaveBeenCalled();
  fireEvent.pointerUp(grip, { pointerId: 1 });
  await waitFor(() => expect(asked).toHaveBeenCalledTimes(1));
  expect(asked).toHaveBeenCalledWith(first, 20);
});

test("keys move an end second by second and ask once; Escape takes it back", async () => {
  const asked = vi.fn<Retime>(() => Promise.resolve(true));
  const { user } = bar(asked);
  handle("Green of stage 2").focus();
  await user.keyboard("{PageUp}{ArrowLeft}{Enter}");
  expect(asked.mock.calls).toEqual([[{ is: "green", stage: "2" }, 19]]);
  handle("Offset").focus();
  await user.keyboard("{ArrowLeft}{Escape}");
  expect(handle("Offset").getAttribute("aria-valuenow")).toBe("5");
  await user.keyboard("{ArrowRight}{ArrowRight}");
  handle("Cycle").focus();
  expect(asked.mock.calls[1]).toEqual([{ is: "offset" }, 7]);
});

test("what is refused goes back to where it was", async () => {
  const { user } = bar(() => Promise.resolve(false));
  handle("Cycle").focus();
  await user.keyboard("{ArrowDown}{Enter}");
  await waitFor(() => expect(handle("Cycle").getAttribute("aria-valuenow")).toBe("40"));
});
