// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { CatalogueView } from "../../src/catalogue/CatalogueView";
import { Conversion } from "../../src/catalogue/Conversion";
import { mapInfo } from "../example";
import { choose, server, show } from "../page";

const names = (): (string | null)[] =>
  within(screen.getByRole("list", { name: "Maps" }))
    .getAllByRole("heading")
    .map((one) => one.textContent);

test("maps are searched, sorted and filtered; what matches none can be taken back", async () => {
  server({ "/scenarios": [], "/maps": [mapInfo("Town", 9), mapInfo("Village", 0)] });
  const { user } = show(<CatalogueView />);
  expect(await screen.findByText("2 maps")).toBeTruthy();
  await choose(user, "Sort by", "Most junctions");
  expect(names()).toEqual(["Town", "Village"]);
  await user.click(screen.getByRole("checkbox", { name: "Junctions" }));
  expect(names()).toEqual(["Town"]);
  await user.type(screen.getByRole("textbox", { name: "Search" }), "village");
  expect(screen.getByText("No matching maps.")).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Show all maps" }));
  expect(names()).toHaveLength(2);
});

test("without maps the example maps are offered", async () => {
  server({ "/scenarios": [], "/maps": [] });
  show(<CatalogueView />);
  expect(await screen.findByRole("button", { name: "Add the example maps" })).toBeTruthy();
  expect(screen.getByText("None yet. Choose a map above, or open a scenario file.")).toBeTruthy();
});

test("a map is only removed after a question", async () => {
  const asked = server({ "/scenarios": [], "/maps": [mapInfo("Town", 9)] });
  const { user } = show(<CatalogueView />);
  await user.click(await screen.findByRole("button", { name: "Remove Town" }));
  await user.click(screen.getByRole("button", { name: "Keep it" }));
  expect(asked.some(({ path }) => path === "/api/maps/Town")).toBe(false);
  await user.click(screen.getByRole("button", { name: "Remove Town" }));
  await user.click(screen.getByRole("button", { name: "Remove" }));
  expect(asked.some(({ path }) => path === "/api/maps/Town")).toBe(true);
});

test("the import report of a map says how much of it can be driven on", async () => {
  server({
    "/maps/Town/report": {
      counts: {},
      figures: { driving_road_length: 100, driving_road_covered: 90 },
      entries: [{ fate: "kept", element: "road 1", reason: "stop, as right of way" }],
    },
  });
  show(<Conversion map="Town" onClose={vi.fn()} />);
  expect(screen.getByRole("dialog", { name: "Import report of Town" })).toBeTruthy();
  expect(await screen.findByText("90 %")).toBeTruthy();
  expect(
    within(screen.getByRole("region", { name: "Imported unchanged" })).getByRole("listitem").textContent,
  ).toBe("Stop signs (road 1)");
});
