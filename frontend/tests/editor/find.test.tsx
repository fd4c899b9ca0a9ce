// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { commandsOf } from "../../src/editor/commands";
import { findAll } from "../../src/editor/find";
import { FindDialog } from "../../src/editor/FindDialog";
import { Graph } from "../../src/map/graph";
import { PlaceNames } from "../../src/map/placeNames";
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

test("roads and junctions are found by the names of their streets, which are listed", async () => {
  const names = new PlaceNames({
    junctions: [{ id: "j21", streets: ["East Street", "North Street"], which: "", legs: [] }],
    roads: [{ id: "r12", street: "North Street", ends: [], side: "" }],
  });
  const streets = new Graph(town.columns, names);
  expect(findAll(streets, ones, "north street").map(({ id, name }) => [id, name])).toEqual([
    ["r12", "North Street"],
    ["j21", "East Street / North Street"],
  ]);
  const { user } = show(
    <FindDialog graph={streets} ones={[]} commands={[]} onGo={vi.fn()} onClose={vi.fn()} />,
  );
  await user.type(await screen.findByRole("combobox", { name: /^Name of a place/ }), "east");
  expect(screen.getByRole("option").textContent).toBe("East Street / North StreetJunction j21");
});

test("what is found is chosen with arrow keys and Enter, or by a click", async () => {
  const [onGo, onClose] = [vi.fn(), vi.fn()];
  const { user } = show(<FindDialog graph={town} ones={ones} commands={[]} onGo={onGo} onClose={onClose} />);
  const field = await screen.findByRole("combobox", { name: /^Name of a place/ });
  await user.type(field, "1{ArrowDown}{ArrowDown}{ArrowUp}{Enter}");
  expect(onGo).toHaveBeenCalledWith({ is: "segment", id: "j1", name: "Junction 1", kind: "Junction" });
  expect(onClose).toHaveBeenCalledOnce();
  await user.click(screen.getByRole("option", { name: /car-1/ }));
  expect(onGo).toHaveBeenLastCalledWith({ is: "one", id: "car-1", name: "car-1", kind: "Car" });
});

test("what is chosen closes the search, and keys act on the map again", async () => {
  const onClose = vi.fn();
  const { user } = show(
    <>
      <div className="map" role="application" tabIndex={0} />
      <FindDialog graph={town} ones={ones} commands={[]} onGo={vi.fn()} onClose={onClose} />
    </>,
  );
  await user.type(await screen.findByRole("combobox", { name: /^Name of a place/ }), "r12{Enter}");
  expect(onClose).toHaveBeenCalledOnce();
  expect(document.activeElement?.className).toBe("map");
});

test("a search that finds nothing says so, and Enter then does nothing", async () => {
  const onGo = vi.fn();
  const { user } = show(<FindDialog graph={graph} ones={[]} commands={[]} onGo={onGo} onClose={vi.fn()} />);
  await user.type(await screen.findByRole("combobox", { name: /^Name of a place/ }), "nowhere{Enter}");
  expect(screen.getByText(/is called “nowhere”/)).toBeTruthy();
  expect(onGo).not.toHaveBeenCalled();
});

test("every action is found by its name, with its keys, and done with Enter", async () => {
  const act = (): void => undefined;
  const doings = {
    run: vi.fn(),
    undo: vi.fn(),
    redo: act,
    openStep: vi.fn(),
    place: vi.fn(),
    placeFlow: vi.fn(),
    selectAll: act,
    showAll: act,
    showRegion: act,
    runs: act,
    studies: act,
    sweeps: act,
    catalogue: act,
    help: act,
    tour: act,
  };
  const commands = commandsOf(doings, [["lights", "Traffic lights"]]);
  const { user } = show(
    <FindDialog graph={town} ones={ones} commands={commands} onGo={vi.fn()} onClose={vi.fn()} />,
  );
  // Without a search all that can be done is listed.
  expect(screen.getAllByRole("option")).toHaveLength(commands.length);
  const field = await screen.findByRole("combobox", { name: /^Name of a place/ });
  await user.type(field, "open lights{Enter}");
  expect(doings.openStep).toHaveBeenCalledExactlyOnceWith("lights");
  await user.clear(field);
  await user.type(field, "place bus{Enter}");
  expect(doings.place).toHaveBeenCalledExactlyOnceWith("bus");
  await user.clear(field);
  await user.type(field, "run");
  expect(screen.getByRole("option", { name: /Run the scenario/ }).textContent).toContain("Ctrl+Enter");
});
