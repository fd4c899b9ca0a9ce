// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { findAll } from "../../src/editor/find";
import { FindDialog } from "../../src/editor/FindDialog";
import { Graph } from "../../src/map/graph";
import { actor, columns, flow, graph } from "../example";
import { show } from "../page";

const town = new Graph({
  ...columns,
  segments: ["r1", "r12", "j1", "j21"].map((id) => ({
    id,
    kind: id.startsWith("j") ? "junction" : "road",
    neighbours: [],
  })),
});
const ones = [actor("car-1"), { ...actor("x"), category: "bus" as const }, flow("flow-1", "1.0.-1.0")];
const names = (search: string) => findAll(town, ones, search).map(({ id }) => id);

test("roads, junctions and road users are found by id and by kind, the exact ones first", () => {
  expect(names("1")).toEqual(["r1", "j1", "r12", "car-1", "flow-1", "j21"]);
  expect(names("junction 1")).toEqual(["j1", "j21"]);
  expect(names("Road 12")).toEqual(["r12"]);
  expect(names("bus")).toEqual(["x"]);
  expect(names("flow")).toEqual(["flow-1"]);
  expect(names("  ")).toEqual([]);
});

test("what is found is chosen with arrow keys and Enter, or by a click", async () => {
  const [onGo, onClose] = [vi.fn(), vi.fn()];
  const { user } = show(<FindDialog graph={town} ones={ones} onGo={onGo} onClose={onClose} />);
  const field = await screen.findByRole("combobox", { name: "Name" });
  await user.type(field, "1{ArrowDown}{ArrowDown}{ArrowUp}{Enter}");
  expect(onGo).toHaveBeenCalledWith({ is: "segment", id: "j1", kind: "Junction" });
  expect(onClose).toHaveBeenCalledOnce();
  await user.click(screen.getByRole("option", { name: /car-1/ }));
  expect(onGo).toHaveBeenLastCalledWith({ is: "one", id: "car-1", kind: "Car" });
});

test("a search that finds nothing says so, and Enter then does nothing", async () => {
  const onGo = vi.fn();
  const { user } = show(<FindDialog graph={graph} ones={[]} onGo={onGo} onClose={vi.fn()} />);
  await user.type(await screen.findByRole("combobox", { name: "Name" }), "nowhere{Enter}");
  expect(screen.getByText(/is called “nowhere”/)).toBeTruthy();
  expect(onGo).not.toHaveBeenCalled();
});
