import { ActionIcon, Alert, Button, Group, Loader, Menu, Modal, NumberInput, Table, Text, Tooltip } from "@mantine/core";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import { createPortal } from "react-dom";

import { api } from "../api/client";
import { type Actor, type Assets, CATEGORIES, type Category, type Edit, type Problem } from "../api/types";
import { ELIGIBLE, GOAL, PEDESTRIAN_NODE, ROI_BASE, ROI_MEMBER, VEHICLE_NODE } from "../map/colors";
import type { PackedDrawing } from "../map/drawing";
import type { Place } from "../map/graph";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import type { Scene } from "../map/scene";
import { IconDown, IconKeys, IconPlay, IconRedo, IconUndo, IconWarn } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { go } from "../ui/route";
import { CATEGORY_WORD, count, mapFacts, weatherWord } from "../ui/words";
import { useLoaded } from "../ui/useLoaded";
import { ActorStep } from "./ActorStep";
import { ActorTable } from "./ActorTable";
import { EnvironmentStep } from "./EnvironmentStep";
import {
  boundsOfProblem, firstStep, insideRows, nearestActor, nearestPlace, actorOfProblem, sceneActors,
  segmentsBounds, segmentStyles, type Step,
} from "./scene";
import { Steps } from "./Steps";
import { createEditorStore, type EditorStore } from "./store";

/** Loads what the editor needs and says what is missing. */
export function EditorView({ scenario: name }: { scenario: string }) {
  const [store] = useState(() => createEditorStore(name));
  const map = store((state) => state.scenario?.document.map.name);
  const [failure, setFailure] = useState<string | null>(null);
  const [drawing, setDrawing] = useState<PackedDrawing | null>(null);
  const [loaded, setLoaded] = useState<LoadedGraph | null>(null);
  const assets = useLoaded(api.assets);

  useEffect(() => {
    store.getState().load().catch((error: unknown) => setFailure(String((error as Error).message)));
  }, [store]);
  useEffect(() => {
    if (!map) return;
    const fail = (error: unknown): void => setFailure(String((error as Error).message));
    loadDrawing(map).then(setDrawing, fail);
    loadGraph(map).then(setLoaded, fail);
  }, [map]);

  if (failure) {
    return (
      <div className="catalogue">
        <Alert color="red" title={`“${name}” cannot be opened`}>{failure}</Alert>
        <Button mt="md" onClick={() => go({ view: "catalogue" })}>Back to the maps</Button>
      </div>
    );
  }
  if (!drawing || !loaded || !map) {
    return <div className="empty"><Loader aria-label="Opening the scenario" /><Text mt="sm">Opening {name} …</Text></div>;
  }
  return <Editor store={store} drawing={drawing} loaded={loaded} assets={assets.value} />;
}

function Editor({ store, drawing, loaded, assets }: {
  store: EditorStore; drawing: PackedDrawing; loaded: LoadedGraph; assets: Assets | null;
}) {
  const { graph, picker } = loaded;
  const { scenario, selection, refusal, name, edit, undo, redo, select, clearRefusal } = store();
  if (!scenario) throw new Error("the editor is only shown with a scenario");
  const { document, problems } = scenario;
  const [step, setStep] = useState<Step>(() => firstStep(document));
  const [armed, setArmed] = useState<Category | null>(null);
  const [hover, setHover] = useState<Place | null>(null);
  const [hoverSegment, setHoverSegment] = useState<number | null>(null);
  const [keys, setKeys] = useState(false);
  const handle = useRef<MapHandle | null>(null);
  const roiKey = document.roi.join("\n");
  const candidates = useCandidates(name, roiKey);
  const selected = useMemo(
    () => document.actors.filter((actor) => selection.includes(actor.id)), [document.actors, selection]);
  const one = selected.length === 1 ? selected[0] : null;
  const { goals, path } = useGoals(name, one, roiKey, loaded);
  const inside = useMemo(() => insideRows(graph, document.roi), [graph, document.roi]);
  const actors = useMemo(
    () => sceneActors(graph, document, assets, selection, problems),
    [graph, document, assets, selection, problems]);

  const scene = useMemo<Scene>(() => {
    const placing = step === "actors";
    const wants = armed ?? one?.category ?? null;
    return {
      segments: segmentStyles(graph, document.roi, candidates, step === "region"),
      hoverSegment: step === "region" ? hoverSegment : null,
      nodes: {
        vehicles: step !== "region" && (!placing || wants !== "pedestrian"),
        walks: step !== "region" && (!placing || wants === null || wants === "pedestrian"),
        inside: placing ? inside : null,
      },
      actors,
      goals: placing ? goals ?? [] : [],
      chosenGoal: placing && one?.goal ? (graph.place(one.goal) ?? null) : null,
      path: placing ? path : [],
      hover: placing ? hover : null,
      hoverCategory: armed,
    };
  }, [graph, document.roi, candidates, step, hoverSegment, armed, one, inside, actors, goals, path, hover]);

  const change = useCallback((asked: Edit) => { void edit(asked); }, [edit]);

  const placeAt = useCallback((at: Pointed): Place | null => armed
    ? picker.place(at.x, at.y, Math.max(at.reach, 6), { vehicles: armed !== "pedestrian", walks: armed === "pedestrian", inside })
    : null, [armed, picker, inside]);

  const pickSegment = (at: Pointed): void => {
    const row = picker.segment(at.x, at.y, Math.max(at.reach, 8));
    if (row === null) return;
    const segment = graph.segmentId(row);
    change({ kind: document.roi.includes(segment) ? "shrink_roi" : "grow_roi", segment });
  };
  const pickActor = (at: Pointed): void => {
    const goal = one && nearestPlace(goals ?? [], at.x, at.y, at.reach);
    const found = nearestActor(actors, at.x, at.y, at.reach);
    if (goal && !found) change({ kind: "set_goal", actor: one.id, goal: goal.id });
    else if (found) choose(found.id, at.shift);
    else if (armed) {
      const place = placeAt(at);
      if (place) change({ kind: "add_actor", category: armed, spawn: place.id });
      else if (!document.roi.length) setStep("region");
      else tell("Nobody can start here. Click on one of the points inside the region.");
    } else select([]);
  };
  const choose = (id: string, more: boolean): void => {
    if (!more) select([id]);
    else select(selection.includes(id) ? selection.filter((other) => other !== id) : [...selection, id]);
  };
  const showGoals = (): void => {
    const start = one && graph.place(one.spawn);
    const seen = start ? [start, ...(goals ?? [])] : [];
    if (seen.length === 0) return;
    const [xs, ys] = [seen.map((place) => place.x), seen.map((place) => place.y)];
    handle.current?.show([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)]);
  };
  const showProblem = (problem: Problem): void => {
    const actor = actorOfProblem(problem, document.actors);
    if (actor) select([actor.id]);
    setStep(actor ? "actors" : problem.where.startsWith("roi") ? "region" : step);
    const bounds = boundsOfProblem(problem, graph, document);
    if (bounds) handle.current?.show(bounds);
  };
  const openStep = (next: Step): void => {
    setStep(next);
    setArmed(null);
    setHover(null);
    if (next === "actors" && document.roi.length > 0) {
      const bounds = segmentsBounds(graph, document.roi);
      if (bounds) handle.current?.show(bounds);
    }
  };
  const run = useStarter(name);

  useKeys({
    undo: () => void undo(), redo: () => void redo(), keys: () => setKeys(true),
    remove: () => { if (selection.length) change({ kind: "remove_actors", actors: [...selection] }); },
    escape: () => { if (armed) { setArmed(null); setHover(null); } else select([]); },
    category: (n) => { setStep("actors"); setArmed(CATEGORIES[n]); },
  });

  const errors = problems.filter((problem) => problem.severity === "error").length;
  const hint = hintFor(step, document.roi.length, armed, hover, loaded);
  return (
    <div className="editor">
      <HeadTools store={store} onKeys={() => setKeys(true)} />
      <div className="side">
        <Steps open={step} onOpen={openStep} steps={{
          map: {
            title: "Map", done: true, note: document.map.name,
            body: <MapStep name={document.map.name} onShow={() => handle.current?.show(drawing.bounds)} />,
          },
          region: {
            title: "Region", done: document.roi.length > 0,
            note: document.roi.length ? count(document.roi.length, "piece") + " of road" : "Where does it happen?",
            body: <RegionStep pieces={document.roi.length} candidates={candidates} onNext={() => openStep("environment")}
              onAll={() => { for (const segment of candidates) change({ kind: "grow_roi", segment }); }}
              onShow={() => { const bounds = segmentsBounds(graph, document.roi); if (bounds) handle.current?.show(bounds); }} />,
          },
          environment: {
            title: "Weather and time", done: document.roi.length > 0, note: weatherNote(assets, document.environment.preset),
            body: assets
              ? <><EnvironmentStep assets={assets} document={document} onEdit={change} />
                <Button onClick={() => openStep("actors")}>Next: road users</Button></>
              : <Loader size="sm" aria-label="Loading the weather" />,
          },
          actors: {
            title: "Road users", done: document.actors.length > 0, note: actorNote(document.actors),
            body: document.roi.length === 0
              ? <><Text size="sm">Road users start inside the region. Choose the region first.</Text>
                <Button onClick={() => openStep("region")}>Choose the region</Button></>
              : <><ActorStep assets={assets} actors={document.actors} selected={selected} armed={armed} goals={goals ? goals.length : null}
                  onShowGoals={showGoals}
                  onArm={(category) => { setArmed(category); if (category) select([]); }} onEdit={change} onSelect={select} />
                {document.actors.length > 0 && <Button variant="default" onClick={() => openStep("run")}>Next: run</Button>}</>,
          },
          run: {
            title: "Run", done: false, note: errors ? count(errors, "problem") + " to solve first" : "Watch it live",
            body: <RunStep key={`${document.simulation.duration} ${document.seed}`} duration={document.simulation.duration} seed={document.seed}
              blocked={errors > 0} busy={run.busy} empty={document.actors.length + document.flows.length === 0} onEdit={change} onRun={run.start} />,
          },
        }} />
        <Problems problems={problems} onShow={showProblem} />
      </div>
      <div className="stage">
        <div className="stage-map" data-armed={armed !== null}>
          <MapCanvas
            drawing={drawing} graph={graph} picker={picker} scene={scene} handle={handle}
            label={`Map ${document.map.name}`} aim={armed !== null || step === "region"}
            onPick={(at) => { if (step === "region") pickSegment(at); else { if (step !== "actors") setStep("actors"); pickActor(at); } }}
            onPoint={(at) => {
              if (step === "region") setHoverSegment(at && picker.segment(at.x, at.y, Math.max(at.reach, 8)));
              else setHover(at && placeAt(at));
            }}
          >
            {hint && <div className="map-hint" role="status">{hint}</div>}
            <Legend step={step} />
          </MapCanvas>
        </div>
        {document.actors.length > 0 && (step === "actors" || step === "run") && (
          <div className="table" role="region" aria-label="Table of road users" tabIndex={0}>
            <ActorTable actors={document.actors} selection={selection} onEdit={change}
              onSelect={(id, more) => {
                setStep("actors");
                choose(id, more);
                const place = graph.place(document.actors.find((actor) => actor.id === id)?.spawn ?? "");
                if (place) handle.current?.centre(place.x, place.y);
              }} />
          </div>
        )}
      </div>
      {refusal && (
        <div className="notices" style={{ bottom: 70 }}>
          <Alert color="orange" variant="filled" autoContrast title="That is not possible" withCloseButton closeButtonLabel="Close this message" onClose={clearRefusal} role="alert">{refusal}</Alert>
        </div>
      )}
      <KeySheet open={keys} onClose={() => setKeys(false)} />
    </div>
  );
}

/** What may be added to the region; asked of the server, which knows the rule. */
function useCandidates(name: string, roiKey: string): readonly string[] {
  const [candidates, setCandidates] = useState<readonly string[]>([]);
  useEffect(() => {
    let current = true;
    api.roi(name).then((found) => { if (current) setCandidates(found.candidates); }, tellError);
    return () => { current = false; };
  }, [name, roiKey]);
  return candidates;
}

/** Where the chosen actor can go, and the way to its goal. */
function useGoals(name: string, actor: Actor | null, roiKey: string, { graph }: LoadedGraph) {
  const [goals, setGoals] = useState<Place[] | null>(null);
  const [path, setPath] = useState<[number, number][]>([]);
  const spawn = actor?.spawn ?? null;
  const goal = actor?.goal ?? null;
  useEffect(() => {
    setGoals(null);
    if (spawn === null) return;
    let current = true;
    api.goals(name, spawn).then(
      (found) => { if (current) setGoals(found.goals.flatMap((id) => graph.place(id) ?? [])); },
      () => { if (current) setGoals([]); },
    );
    return () => { current = false; };
  }, [name, spawn, roiKey, graph]);
  useEffect(() => {
    setPath([]);
    if (spawn === null || goal === null) return;
    let current = true;
    api.path(name, spawn, goal).then((found) => { if (current) setPath(found.points); }, () => undefined);
    return () => { current = false; };
  }, [name, spawn, goal, roiKey]);
  return { goals, path };
}

function useStarter(name: string): { busy: boolean; start: () => void } {
  const [busy, setBusy] = useState(false);
  return {
    busy,
    start: () => {
      setBusy(true);
      api.startRun(name).then(
        ({ run }) => go({ view: "run", scenario: name, run }),
        (error: unknown) => { setBusy(false); tellError(error); },
      );
    },
  };
}

interface KeyActions {
  undo: () => void;
  redo: () => void;
  remove: () => void;
  escape: () => void;
  keys: () => void;
  category: (n: number) => void;
}

/** Shortcuts that hold everywhere but in fields. */
function useKeys(actions: KeyActions): void {
  const latest = useRef(actions);
  useEffect(() => { latest.current = actions; });
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      const target = event.target as HTMLElement;
      if (target.closest("input, textarea, [role=dialog], [role=listbox]")) return;
      const mod = event.ctrlKey || event.metaKey;
      const key = event.key.toLowerCase();
      if (mod && key === "z") (event.shiftKey ? latest.current.redo : latest.current.undo)();
      else if (mod && key === "y") latest.current.redo();
      else if (mod || event.altKey) return;
      else if (key === "delete" || key === "backspace") latest.current.remove();
      else if (key === "escape") latest.current.escape();
      else if (key === "?") latest.current.keys();
      else if (/^[1-7]$/.test(key)) latest.current.category(Number(key) - 1);
      else return;
      event.preventDefault();
    };
    addEventListener("keydown", onKey);
    return () => removeEventListener("keydown", onKey);
  }, []);
}

const SAVED = { saved: "All changes saved", saving: "Saving …", failed: "Not saved" } as const;
const named = (label: unknown): string => (typeof label === "string" && label ? `: ${label}` : "");

/** Undo, redo, autosave and files, in the head of the page. */
function HeadTools({ store, onKeys }: { store: EditorStore; onKeys: () => void }) {
  const { scenario, saving, undo, redo, name } = store();
  const [slot, setSlot] = useState<HTMLElement | null>(null);
  useEffect(() => setSlot(document.getElementById("head-slot")), []);
  if (!slot) return null;
  const tools = [
    { word: "Undo", keys: "Ctrl+Z", label: scenario?.undo, act: undo, icon: <IconUndo /> },
    { word: "Redo", keys: "Ctrl+Y", label: scenario?.redo, act: redo, icon: <IconRedo /> },
  ];
  return createPortal(
    <>
      <span className="saving" role="status">{SAVED[saving]}</span>
      {tools.map(({ word, keys, label, act, icon }) => (
        <Tooltip key={word} label={`${word}${named(label)} (${keys})`}>
          <ActionIcon variant="default" size="lg" aria-label={`${word}${named(label)}`} disabled={label === null || label === false}
            onClick={() => void act()}>{icon}</ActionIcon>
        </Tooltip>
      ))}
      <Menu position="bottom-end">
        <Menu.Target><Button variant="default" leftSection={<IconDown />}>Download</Button></Menu.Target>
        <Menu.Dropdown>
          <Menu.Item component="a" href={api.downloadUrl(name, "json")} download>As a document (JSON)</Menu.Item>
          <Menu.Item component="a" href={api.downloadUrl(name, "graphml")} download>As a graph (GraphML)</Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <Tooltip label="Keyboard shortcuts (?)">
        <ActionIcon variant="subtle" color="gray" size="lg" aria-label="Keyboard shortcuts" onClick={onKeys}><IconKeys /></ActionIcon>
      </Tooltip>
    </>, slot);
}

function MapStep({ name, onShow }: { name: string; onShow: () => void }) {
  const load = useCallback(() => api.map(name), [name]);
  const { value } = useLoaded(load);
  return (
    <>
      <Text size="sm">{value ? mapFacts(value.statistics).join(" · ") : "…"}</Text>
      <Group>
        <Button size="compact-sm" variant="default" onClick={onShow}>Show the whole map</Button>
        <Button size="compact-sm" variant="subtle" onClick={() => go({ view: "catalogue" })}>Choose another map</Button>
      </Group>
    </>
  );
}

function RegionStep({ pieces, candidates, onNext, onAll, onShow }: {
  pieces: number; candidates: readonly string[]; onNext: () => void; onAll: () => void; onShow: () => void;
}) {
  if (pieces === 0) {
    return <Text size="sm">Click the road or junction where your scenario begins. It turns dark blue; then let the region grow around it.</Text>;
  }
  return (
    <>
      <Text size="sm">Click a <b>light-blue</b> piece to add it, or a piece of the region to take it out again.</Text>
      <Group>
        <Button size="compact-sm" variant="default" disabled={candidates.length === 0} onClick={onAll}>Add all {candidates.length} neighbours</Button>
        <Button size="compact-sm" variant="subtle" onClick={onShow}>Show the region</Button>
      </Group>
      <Button onClick={onNext}>Next: weather and time</Button>
    </>
  );
}

function RunStep({ duration, seed, blocked, empty, busy, onEdit, onRun }: {
  duration: number; seed: number; blocked: boolean; empty: boolean; busy: boolean;
  onEdit: (edit: Edit) => void; onRun: () => void;
}) {
  return (
    <>
      <Group grow>
        <NumberInput label="Lasts" suffix=" s" min={1} max={1e6} defaultValue={duration}
          onBlur={(event) => { const value = Number.parseFloat(event.currentTarget.value); if (value > 0 && value !== duration) onEdit({ kind: "set_simulation", duration: value }); }} />
        <NumberInput label="Chance number" description="same number, same traffic" inputWrapperOrder={["label", "input", "description"]} min={0} allowDecimal={false} defaultValue={seed}
          onBlur={(event) => { const value = Number.parseInt(event.currentTarget.value, 10); if (value >= 0 && value !== seed) onEdit({ kind: "set_seed", seed: value }); }} />
      </Group>
      {empty && <Text size="sm">Nobody is in the scenario yet.</Text>}
      {blocked && <Text size="sm" c="red">Solve the problems listed below first.</Text>}
      <Button size="md" leftSection={<IconPlay />} loading={busy} disabled={blocked || empty} onClick={onRun}>Run</Button>
    </>
  );
}

function Problems({ problems, onShow }: { problems: readonly Problem[]; onShow: (problem: Problem) => void }) {
  if (problems.length === 0) return null;
  return (
    <section className="problems" aria-label="Problems">
      <Text size="sm" fw={700} px={8} pb={2} role="status">{count(problems.length, "thing")} to look at</Text>
      {problems.map((problem) => (
        <button type="button" className="problem" key={`${problem.where} ${problem.code} ${problem.message}`} onClick={() => onShow(problem)}>
          <span style={{ color: problem.severity === "error" ? "#e03131" : "#b7791f" }}><IconWarn /></span>
          <span>{problem.message}</span>
        </button>
      ))}
    </section>
  );
}

function Legend({ step }: { step: Step }) {
  const rows: [string, string][] = step === "region"
    ? [[ROI_BASE, "First piece"], [ROI_MEMBER, "Region"], [ELIGIBLE, "Can be added"]]
    : step === "actors" ? [[VEHICLE_NODE, "Vehicles can start"], [PEDESTRIAN_NODE, "People can start"], [GOAL, "Possible goal"]] : [];
  if (rows.length === 0) return null;
  return (
    <div className="map-legend" aria-hidden="true">
      {rows.map(([color, word]) => <span key={word}><i style={{ background: color }} />{word}</span>)}
    </div>
  );
}

const SHORTCUTS: [string, string][] = [
  ["Ctrl+Z / Ctrl+Y", "Undo / redo"], ["1 – 7", "Place a car, van, truck, bus, motorcycle, bicycle, pedestrian"],
  ["Escape", "Stop placing, select nothing"], ["Delete", "Remove what is selected"], ["Shift + click", "Select several"],
  ["Arrow keys", "Move the map (with Shift: a little)"], ["+ / −", "Zoom"], ["0", "Show the whole map"],
  ["Enter", "On the map: choose what is in the middle"], ["?", "This sheet"],
];

function KeySheet({ open, onClose }: { open: boolean; onClose: () => void }) {
  return (
    <Modal opened={open} onClose={onClose} title="Keyboard shortcuts" centered size="lg">
      <Table>
        <Table.Tbody>
          {SHORTCUTS.map(([key, what]) => <Table.Tr key={key}><Table.Td><kbd>{key}</kbd></Table.Td><Table.Td>{what}</Table.Td></Table.Tr>)}
        </Table.Tbody>
      </Table>
    </Modal>
  );
}

function hintFor(step: Step, pieces: number, armed: Category | null, hover: Place | null, { graph }: LoadedGraph): string | null {
  if (step === "region" && pieces === 0) return "Click a road or junction to begin the region";
  if (step !== "actors" || !armed) return null;
  if (!hover) return `Point at the ${armed === "pedestrian" ? "edge of a road" : "lane"} where the ${CATEGORY_WORD[armed].toLowerCase()} starts`;
  const degrees = Math.round((((90 - (hover.hdg * 180) / Math.PI) % 360) + 360) % 360);
  const lane = hover.walk ? "walkway" : `${graph.columns.lane_types[graph.columns.lane[hover.index]]} lane`;
  return hover.walk ? `Point ${hover.id}, ${lane}` : `Point ${hover.id}, ${lane}, heading ${degrees}°`;
}

function weatherNote(assets: Assets | null, preset: string): string {
  const found = assets?.weather.find((one) => one.name === preset);
  return found ? weatherWord(found) : preset;
}

function actorNote(actors: readonly Actor[]): string {
  if (actors.length === 0) return "Who is on the road?";
  const parts = CATEGORIES.flatMap((category) => {
    const n = actors.filter((actor) => actor.category === category).length;
    const word = CATEGORY_WORD[category].toLowerCase();
    return n ? [count(n, word, word === "bus" ? "buses" : `${word}s`)] : [];
  });
  return parts.join(", ");
}
