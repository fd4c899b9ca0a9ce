// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import { CatalogueView } from "../../src/catalogue/CatalogueView";
import { Conversion } from "../../src/catalogue/Conversion";
import { NoticeList } from "../../src/ui/notices";
import { mapInfo } from "../example";
import { choose, rowsOf, server, show } from "../page";
import { stubFetch } from "../requests";

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

test("a map that an earlier odscen has built says so", async () => {
  server({ "/scenarios": [], "/maps": [mapInfo("Town", 9), { ...mapInfo("Village", 0), outdated: true }] });
  show(<CatalogueView />);
  expect(await screen.findAllByText(/^Built by an earlier odscen/)).toHaveLength(1);
});

test("a map says what of it was lost for traffic, and what was guessed", async () => {
  const lossy = { ...mapInfo("Village", 0), lost: { signals: 2, roads: 1 }, guessed: { connections: 3 } };
  server({ "/scenarios": [], "/maps": [mapInfo("Town", 9), lossy] });
  show(<CatalogueView />);
  expect(await screen.findAllByText("Lost for traffic: 2 lights and signs, 1 road")).toHaveLength(1);
  expect(screen.getAllByText("Guessed: 3 connections")).toHaveLength(1);
});

test("without maps the example maps are offered", async () => {
  server({ "/scenarios": [], "/maps": [] });
  show(<CatalogueView />);
  expect(await screen.findByRole("button", { name: "Add the example maps" })).toBeTruthy();
  expect(screen.getByText("None yet. Choose a map above, or open a scenario file.")).toBeTruthy();
});

const entryOf = (name: string, modified: number, title = name) => ({
  name,
  title,
  map: "Town",
  actors: 3,
  modified,
  error: null,
});

const CUT_IN = {
  name: "cut-in",
  title: "Cut-in",
  summary: "A slower vehicle changes into the lane of the ego.",
  source: "UN Regulation No. 157",
  needs: "two lanes of one direction",
  numbers: [
    {
      name: "speed",
      title: "Cut-in vehicle speed",
      usual: 10,
      low: 1,
      high: 58,
      unit: "m/s",
      meaning: "speed",
    },
    { name: "ttc", title: "Time to collision", usual: null, low: 0.1, high: 10, unit: "s", meaning: "limit" },
  ],
};

test("maps with room for a template are listed first, and of the others it is said why not", async () => {
  const why = "Village has no room for a cut-in: of 3 lanes none has one beside it";
  stubFetch(({ path, body }) => {
    const { map } = (body ?? {}) as { map?: string };
    const answer = path.endsWith("/room")
      ? { reason: map === "Village" ? why : "" }
      : path.endsWith("/templates")
        ? [CUT_IN]
        : path.endsWith("/maps")
          ? [mapInfo("Village", 0), mapInfo("Town", 9)]
          : [];
    return new Response(JSON.stringify(answer));
  });
  const { user } = show(<CatalogueView />);
  await user.click(await screen.findByRole("button", { name: "Place on a map: Cut-in" }));
  const dialog = await screen.findByRole("dialog", { name: "Cut-in" });
  expect(within(dialog).getByRole("textbox", { name: "Cut-in vehicle speed (km/h)" })).toBeTruthy();
  expect(within(dialog).getByRole("textbox", { name: "Time to collision (s)" })).toHaveProperty(
    "placeholder",
    "calculated",
  );
  await user.click(within(dialog).getByRole("textbox", { name: "Map" }));
  expect(await screen.findByText("Without a suitable location")).toBeTruthy();
  const names = screen.getAllByRole("option").map((one) => one.textContent ?? "");
  expect(names.filter((one) => ["Town", "Village"].includes(one))).toEqual(["Town", "Village"]);
  expect(screen.queryByText("Not checked yet")).toBeNull();
  await user.click(screen.getByRole("option", { name: "Village" }));
  expect((await within(dialog).findByRole("alert")).textContent).toContain(why);
});

test("own scenarios come first, the newest at the top, and two of one title are told apart", async () => {
  const many = Array.from({ length: 9 }, (_, n) =>
    entryOf(`Town-${n}`, 100 + n, n < 2 ? "Town" : `Trip ${n}`),
  );
  server({ "/broken-maps": [], "/scenarios": many, "/maps": [mapInfo("Town", 9)] });
  const { user } = show(<CatalogueView />);
  const table = await screen.findByRole("table", { name: "Your scenarios" });
  const headings = screen.getAllByRole("heading").map((one) => one.textContent);
  expect(headings.indexOf("Your scenarios")).toBeLessThan(headings.indexOf("Choose a map"));
  expect(rowsOf(table).map(([title]) => title)).toEqual([8, 7, 6, 5, 4, 3].map((n) => `Trip ${n}`));
  await user.click(screen.getByRole("button", { name: "Show all 9 scenarios" }));
  expect(
    rowsOf(table)
      .map(([title]) => title)
      .slice(-2),
  ).toEqual(["TownTown-1", "TownTown-0"]);
});

const ITEM = { id: "map-1", kind: "map", name: "Town", removed: 1.8e9, until: 1.8e9 + 2_592_000 };

test("the example maps can be added when there are maps already", async () => {
  const asked = server({
    "/maps/shipped": { job: "j1" },
    "/jobs/j1": { job: "j1", state: "done", step: "done", share: 1, result: "a", error: null },
    "/broken-maps": [],
    "/scenarios": [],
    "/maps": [mapInfo("Town", 9)],
  });
  const { user } = show(<CatalogueView />);
  await user.click(await screen.findByRole("button", { name: "Add the example maps" }));
  expect(asked.some(({ path }) => path === "/api/maps/shipped")).toBe(true);
});

test("a map is only removed after a question with facts, and the notice undoes it", async () => {
  const asked = server({
    "/removal": { kind: "map", name: "Town", scenarios: 2, runs: 3, live: 1 },
    "/maps/Town": ITEM,
    "/trash/map-1/restore": ITEM,
    "/scenarios": [],
    "/broken-maps": [],
    "/maps": [mapInfo("Town", 9)],
  });
  const { user } = show(
    <>
      <CatalogueView />
      <NoticeList />
    </>,
  );
  const sent = (path: string): boolean => asked.some((one) => one.path === path);
  await user.click(await screen.findByRole("button", { name: "Remove Town" }));
  expect(await screen.findByText(/^2 scenarios and 3 runs, 1 of them live were made/)).toBeTruthy();
  expect(screen.getByText(/wastebasket for 30 days/)).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Keep it" }));
  expect(sent("/api/maps/Town")).toBe(false);
  await user.click(screen.getByRole("button", { name: "Remove Town" }));
  await screen.findByText(/^2 scenarios/);
  await user.click(screen.getByRole("button", { name: "Remove" }));
  expect(sent("/api/maps/Town")).toBe(true);
  expect(await screen.findByText("Town is in the wastebasket.")).toBeTruthy();
  await user.click(screen.getByRole("button", { name: "Undo" }));
  expect(sent("/api/trash/map-1/restore")).toBe(true);
});

test("a damaged map is named with a way out, beside those that can be used", async () => {
  server({
    "/scenarios": [],
    "/broken-maps": [{ name: "Torn", problem: "its map.json is damaged" }],
    "/removal": { kind: "map", name: "Torn", scenarios: 0, runs: 0, live: 0 },
    "/maps": [mapInfo("Town", 9)],
  });
  const { user } = show(<CatalogueView />);
  const alert = await screen.findByRole("alert");
  expect(within(alert).getByText("A map is damaged")).toBeTruthy();
  expect(names()).toEqual(["Town"]);
  await user.click(within(alert).getByRole("button", { name: "Remove Torn" }));
  expect(await screen.findByText("Nothing was made on this map.")).toBeTruthy();
});

test("what is in the wastebasket is restored at once, and deleted only after a second click", async () => {
  const other = { ...ITEM, id: "run-2", kind: "run", name: "Town-1", size: 2_500_000 };
  const asked = server({
    "/trash/": ITEM,
    "/trash": [{ ...ITEM, size: 4_000_000 }, other],
    "/scenarios": [],
    "/broken-maps": [],
    "/maps": [],
  });
  const { user } = show(<CatalogueView />);
  const sent = (path: string): boolean => asked.some((one) => one.path === path);
  await user.click(await screen.findByRole("button", { name: "Wastebasket" }));
  const rows = rowsOf(await screen.findByRole("table", { name: "Wastebasket" }));
  expect(rows.map((row) => [row[0], row[1], row[4]])).toEqual([
    ["Town", "Map", "4 MB"],
    ["Town-1", "Run", "2.5 MB"],
  ]);
  await user.click(screen.getByRole("button", { name: "Delete Town-1" }));
  expect(sent("/api/trash/run-2")).toBe(false);
  await user.click(screen.getByRole("button", { name: "Delete Town-1 for good" }));
  expect(sent("/api/trash/run-2")).toBe(true);
  await user.click(await screen.findByRole("button", { name: "Restore Town" }));
  expect(sent("/api/trash/map-1/restore")).toBe(true);
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
