// @vitest-environment happy-dom
import { screen, within } from "@testing-library/react";
import { expect, test, vi } from "vitest";

import type { Format, ImportReport, ImportRow } from "../../src/api/exchange";
import { ExportDialog } from "../../src/exchange/ExportDialog";
import { ImportWork } from "../../src/exchange/ImportWork";
import { elementWord, grouped, pinsOf, plainReason } from "../../src/exchange/report";
import { ReportPanel } from "../../src/exchange/ReportPanel";
import { useImport } from "../../src/exchange/useImport";
import { parseAddress } from "../../src/ui/address";
import { server, show } from "../page";

const STORY = "/OpenSCENARIO/Storyboard/Story/Act";
const row = (xpath: string, line: number, reason = "", at: [number, number] | null = null): ImportRow => ({
  file: "cut_in.xosc",
  xpath,
  line,
  reason,
  x: at?.[0] ?? null,
  y: at?.[1] ?? null,
});
const OPENSCENARIO: Format = {
  id: "openscenario",
  title: "OpenSCENARIO",
  description: "",
  of: ["scenario", "run"],
  suffixes: [".xosc"],
  reads: true,
  writes: true,
  options: [{ name: "version", label: "Version", values: ["1.0", "1.2"], default: "1.2" }],
};
const NO_PART = "odscen has no part for it";
const REPORT: ImportReport = {
  scenario: "cut_in-1",
  file: "cut_in.xosc",
  map: "road",
  added: false,
  sweep: false,
  refused: [
    row(`${STORY}/Event[2]`, 40, `left out: ${STORY}/Event[2]/Action/Horn (line 44): no horn`, [3, 4]),
  ],
  approximated: [
    { ...row("/OpenSCENARIO/Catalog/Vehicle", 7, "a car of the usual size", [3, 4]), file: "cars.xosc" },
    row(`${STORY}/Event[1]`, 30, "runs beside other events of its maneuver"),
  ],
  ignored: [
    row(`${STORY}/StopTrigger`, 50, NO_PART),
    row(`${STORY}/StopTrigger/ConditionGroup`, 51, NO_PART),
    row(`${STORY}/StopTrigger/ConditionGroup/Condition[1]`, 52, NO_PART),
    row("/OpenSCENARIO/RoadNetwork/SceneGraphFile", 9, NO_PART, [9, 9]),
  ],
  taken: [row("/OpenSCENARIO", 1), row("/OpenSCENARIO/Entities/ScenarioObject[1]", 4), row(STORY, 20)],
};

test("elements, reasons and groups are told in plain words", () => {
  expect(elementWord("/A/RelativeTargetSpeed[2]")).toBe("Relative target speed");
  expect(plainReason(`left out: ${STORY}/Event[1]/Horn[3] (line 44): no horn`)).toBe(
    "Horn in line 44: no horn",
  );
  expect(plainReason(NO_PART)).toBe("There is nothing like this in a scenario of odscen");
  const [group] = grouped(REPORT.ignored);
  expect(group?.elements.map(({ word, inside }) => [word, inside])).toEqual([
    ["Stop trigger", 2],
    ["Scene graph file", 0],
  ]);
});

test("pins tell the worst that happened at a place, once", () => {
  expect(pinsOf(REPORT, { x: 9, y: 9 })).toEqual([
    { x: 3, y: 4, sign: "!", text: "2 elements" },
    { x: 9, y: 9, sign: "–", text: "line 9", rule: "strong" },
  ]);
});

test("the report begins with how much, lists the refused first and shows places on the map", async () => {
  const onPlace = vi.fn();
  const { user } = show(<ReportPanel report={REPORT} chosen={null} onPlace={onPlace} />);
  expect(
    screen.getByText(/^1 element could not be imported\. Of 10 elements in the file, 30 %/),
  ).toBeTruthy();
  const counts = [...document.querySelectorAll(".import-counts dd")].map((one) => one.textContent);
  expect(counts).toEqual(["1", "2", "4", "3"]);
  const sections = screen.getAllByRole("region");
  expect(sections.map((one) => one.getAttribute("aria-label"))).toEqual([
    "Not supported (affects behaviour)",
    "Imported approximately",
    "Without a counterpart here",
    "Imported unchanged",
  ]);
  const [refused, approximated] = sections as [HTMLElement, HTMLElement];
  await user.click(within(refused).getByRole("button", { name: "Event, line 40: show on the map" }));
  expect(onPlace).toHaveBeenCalledWith(REPORT.refused[0]);
  expect(within(approximated).getByRole("button", { name: /^Vehicle, line 7 of cars\.xosc/ })).toBeTruthy();
  expect(
    within(approximated)
      .getByText(/^Event, line 30$/)
      .closest("button"),
  ).toBeNull();
});

test("a file of which everything acts says so", () => {
  show(<ReportPanel report={{ ...REPORT, refused: [] }} chosen={null} onPlace={() => undefined} />);
  expect(screen.getByText(/^Everything that acts was imported\. Of 9 elements/)).toBeTruthy();
});

const DONE = { id: "j1", state: "done", step: "done", share: 1, result: "cut_in-1", error: null };
const FAILED = {
  ...DONE,
  state: "failed",
  result: null,
  error: { kind: "InputError", message: "it plays on the map 'road.xodr'", problems: [], current: null },
};

function Importer({ files }: { files: File[] }) {
  const work = useImport();
  return (
    <>
      <button type="button" onClick={() => work.begin(files)}>
        Drop
      </button>
      <ImportWork work={work} />
    </>
  );
}

test("a refused import keeps its files and takes the map that it lacks", async () => {
  const asked = server({ "/imports": { job: "j1" }, "/jobs/j1": FAILED });
  const { user } = show(<Importer files={[new File(["<a/>"], "cut_in.xosc")]} />);
  await user.click(screen.getByText("Drop"));
  expect(await screen.findByText("it plays on the map 'road.xodr'")).toBeTruthy();
  expect(screen.getByText("cut_in.xosc could not be imported")).toBeTruthy();
  const again = server({ "/imports": { job: "j1" }, "/jobs/j1": DONE });
  const field = document.querySelector<HTMLInputElement>("input[type=file]");
  if (field) await user.upload(field, new File(["<b/>"], "road.xodr"));
  await vi.waitFor(() =>
    expect(parseAddress(location.hash)).toEqual({ view: "imported", scenario: "cut_in-1" }),
  );
  const names = (sent: { body: unknown } | undefined): string[] =>
    sent?.body instanceof FormData ? sent.body.getAll("files").map((one) => (one as File).name) : [];
  expect(names(asked[0])).toEqual(["cut_in.xosc"]);
  expect(names(again[0])).toEqual(["cut_in.xosc", "road.xodr"]);
});

test("an export says what its version cannot before it is downloaded", async () => {
  const asked = server({
    "/export/notes": {
      files: ["a.export.json", "a.xosc", "road.xodr"],
      approximated: [],
      left_out: [
        { place: "flows", reason: "OpenSCENARIO has no word for it" },
        { place: "seed", reason: "OpenSCENARIO has no word for it" },
      ],
    },
  });
  show(<ExportDialog name="a" format={OPENSCENARIO} onClose={() => undefined} />);
  expect(await screen.findByText("Not exported: 2")).toBeTruthy();
  expect(screen.getByText("flows, seed")).toBeTruthy();
  expect(asked[0]?.path).toBe("/api/scenarios/a/export/notes?to=openscenario&version=1.2");
  const link = screen.getByRole("link", { name: "Download (ZIP)" });
  expect(link.getAttribute("href")).toBe("/api/scenarios/a/export?to=openscenario&version=1.2");
});

test("a scenario that cannot be exported says why, and offers no download", async () => {
  server({});
  show(
    <ExportDialog
      name="a"
      format={{ ...OPENSCENARIO, id: "sumo", title: "SUMO", options: [] }}
      onClose={() => undefined}
    />,
  );
  expect(await screen.findByText("It cannot be exported as it is")).toBeTruthy();
  expect(screen.queryByRole("link", { name: "Download (ZIP)" })).toBeNull();
});
