import { Button, Loader, Text } from "@mantine/core";
import { useMemo, useRef, useState } from "react";

import { type Assets, CATEGORIES, type Edit, type Problem } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import type { Place } from "../map/graph";
import type { LoadedGraph } from "../map/loaded";
import { MapCanvas, type MapHandle, type Pointed } from "../map/MapCanvas";
import type { Scene } from "../map/scene";
import { tell } from "../ui/notices";
import { CATEGORY_WORD, count } from "../ui/words";
import { ActorStep } from "./ActorStep";
import { useRegion, useStarter, useWays } from "./asked";
import { profilesOf } from "./DayProfiles";
import { bringsSomebody, trafficNote } from "./demand";
import { EnvironmentStep } from "./EnvironmentStep";
import { HeadTools } from "./HeadTools";
import { useKeys } from "./keys";
import { KeySheet } from "./KeySheet";
import { Legend } from "./Legend";
import { MapStep, RegionStep } from "./MapSteps";
import { actorNote, hintFor, weatherNote } from "./notes";
import { laneFacts } from "./placeWords";
import { everyone, isFlow, type Tool, toolWord } from "./placing";
import { Problems } from "./Problems";
import { RefusalAlert } from "./RefusalAlert";
import { RoadUserTable } from "./RoadUserTable";
import { RunStep } from "./RunStep";
import { boundsOfPlaces, boundsOfProblem, firstStep, inFrame, nearestOne, ofProblem, segmentsBounds, segmentStyles, type Step } from "./scene";
import { Steps } from "./Steps";
import type { EditorStore } from "./store";
import { firstVisit, Tour, tourSeen } from "./Tour";
import { TrafficStep } from "./TrafficStep";
import { useChanges } from "./useChanges";
import { useShown } from "./useShown";

/** A click this near to a segment means it, metres. */
const SEGMENT_REACH = 8;

/** The editor of one scenario: what is open, what is chosen, and what a click does. */
export function Editor({ store, drawing, loaded, assets }: {
  store: EditorStore; drawing: PackedDrawing; loaded: LoadedGraph; assets: Assets | null;
}) {
  const { graph, picker } = loaded;
  const { scenario, selection, name, undo, redo, select } = store();
  if (!scenario) throw new Error("the editor is only shown with a scenario");
  const { document, problems } = scenario;
  const [step, setStep] = useState<Step>(() => firstStep(document));
  const [tool, setTool] = useState<Tool | null>(null);
  const [hover, setHover] = useState<Place | null>(null);
  const [hoverSegment, setHoverSegment] = useState<number | null>(null);
  const [keys, setKeys] = useState(false);
  const [tour, setTour] = useState(firstVisit);
  const [filling, setFilling] = useState(false);
  const carried = useRef<string | null>(null);
  const handle = useRef<MapHandle | null>(null);

  const roiKey = document.roi.join("\n");
  const roi = useRegion(name, roiKey);
  const ones = useMemo(() => everyone(document), [document]);
  const selected = useMemo(() => {
    const chosen = new Set(selection);
    return ones.filter((one) => chosen.has(one.id));
  }, [ones, selection]);
  const one = selected.length === 1 ? selected[0] ?? null : null;
  const { goals, path } = useWays(name, one, roiKey, graph);
  const { inside, starts, actors, flows } = useShown(loaded, document, assets, selection, problems);
  const changes = useChanges(store, ones, starts);
  const run = useStarter(name);

  const onFoot = (ids: readonly string[]): boolean => Boolean(graph.place(ones.find((each) => each.id === ids[0])?.spawn ?? "")?.walk);
  const walks = !tool ? null : tool.does === "place" ? tool.category === "pedestrian" : tool.does === "stream" ? tool.walk : onFoot(tool.ids);
  const wantsWalks = walks ?? (one ? onFoot([one.id]) : null);
  const placing = step === "actors";
  // Where segments are what one points at.
  const naming = step === "region" || step === "traffic";
  const roads = useMemo(() => {
    const kinds = new Map(graph.columns.segments.map(({ id, kind }) => [id, kind]));
    return document.roi.filter((id) => kinds.get(id) !== "junction");
  }, [graph, document.roi]);
  const profiles = useMemo(() => profilesOf(document.demand, assets?.day_profiles ?? {}), [document.demand, assets]);

  const scene = useMemo<Scene>(() => ({
    segments: segmentStyles(graph, document.roi, roi.candidates, step === "region"),
    hoverSegment: naming ? hoverSegment : null,
    nodes: {
      vehicles: step !== "region" && (!placing || wantsWalks !== true),
      walks: step !== "region" && (!placing || wantsWalks !== false),
      inside: placing ? inside : null,
    },
    actors, flows,
    goals: placing ? goals ?? [] : [],
    chosenGoal: placing && one?.goal ? (graph.place(one.goal) ?? null) : null,
    path: placing ? path : [],
    hover: placing ? hover : null,
    hoverText: placing && hover ? laneFacts(graph, hover.id) : null,
    hoverCategory: tool?.does === "place" ? tool.category : null,
  }), [graph, document.roi, roi.candidates, step, placing, naming, hoverSegment, wantsWalks, inside, actors, flows, goals, one, path, hover, tool]);

  const openStep = (next: Step): void => {
    setStep(next);
    setTool(null);
    setHover(null);
    if (next === "actors") showRegion();
  };
  const showRegion = (): void => showSegments(document.roi);
  const showSegments = (segments: readonly string[]): void => {
    const bounds = segmentsBounds(graph, segments);
    if (bounds) handle.current?.show(bounds);
  };
  const arm = (next: Tool | null): void => {
    setTool(next);
    setHover(null);
    if (next?.does === "place" || next?.does === "stream") select([]);
  };
  const applyTool = (used: Tool, to: Place): void => { if (changes.use(used, to)) arm(null); };
  const closeTour = (): void => {
    tourSeen();
    setTour(false);
  };
  const choose = (id: string, more: boolean): void => {
    if (!more) select([id]);
    else select(selection.includes(id) ? selection.filter((other) => other !== id) : [...selection, id]);
  };
  const oneAt = (at: Pointed): string | null =>
    (nearestOne(actors, at.x, at.y, at.reach) ?? nearestOne(flows, at.x, at.y, at.reach))?.id ?? null;

  const pickSegment = (at: Pointed): void => {
    const row = picker.segment(at.x, at.y, Math.max(at.reach, SEGMENT_REACH));
    if (row === null) return;
    const segment = graph.segmentId(row);
    changes.change({ kind: document.roi.includes(segment) ? "shrink_roi" : "grow_roi", segment });
  };
  const pickOne = (at: Pointed): void => {
    const found = oneAt(at);
    const goal = one && !found ? nearestOne(goals ?? [], at.x, at.y, at.reach) : null;
    if (goal && one && tool?.does !== "copy" && tool?.does !== "move") changes.setGoal(one, goal.id);
    else if (tool && walks !== null && !found) {
      const to = starts.near(at.x, at.y, at.reach, walks);
      if (to) applyTool(tool, to);
      else if (document.roi.length === 0) openStep("region");
      else tell(starts.reasonAt(at.x, at.y, at.reach, walks, toolWord(tool, CATEGORY_WORD)));
    } else if (found) choose(found, at.shift);
    else if (!at.shift) select([]);
  };
  const placeSomewhere = (): void => {
    if (!tool || walks === null) return;
    const to = starts.first(walks, ones.flatMap((each) => graph.place(each.spawn) ?? []));
    if (to) applyTool(tool, to);
    else tell("No free point is left inside the region.");
  };
  const point = (at: Pointed | null): void => {
    if (naming) setHoverSegment(at && picker.segment(at.x, at.y, Math.max(at.reach, SEGMENT_REACH)));
    else if (!at) setHover(null);
    else if (carried.current) setHover(starts.near(at.x, at.y, at.reach, onFoot([carried.current])));
    else setHover(walks === null ? null : starts.near(at.x, at.y, at.reach, walks));
  };
  const drop = (at: Pointed): void => {
    const id = carried.current;
    carried.current = null;
    const to = id && starts.near(at.x, at.y, at.reach, onFoot([id]));
    setHover(null);
    if (!id) return;
    if (to) changes.use({ does: "move", ids: selection.includes(id) ? [id, ...selection.filter((other) => other !== id)] : [id] }, to);
    else tell(starts.reasonAt(at.x, at.y, at.reach, onFoot([id]), "road user"));
  };
  const showProblem = (problem: Problem): void => {
    const about = ofProblem(problem, document);
    if (about) select([about.id]);
    setStep(about ? "actors" : problem.where.startsWith("roi") ? "region" : problem.where.startsWith("demand") ? "traffic" : step);
    const bounds = boundsOfProblem(problem, graph, document);
    if (bounds) handle.current?.show(bounds);
  };
  const showGoals = (): void => {
    const start = one && graph.place(one.spawn);
    if (start) handle.current?.show(boundsOfPlaces([start, ...(goals ?? [])]));
  };
  const fill = (share: number, seed: number): void => {
    setFilling(true);
    void changes.fill(share, seed).finally(() => setFilling(false));
  };
  const copyTool = (): void => {
    const ids = selected.filter((each) => !isFlow(each)).map((each) => each.id);
    if (ids.length > 0) { setStep("actors"); arm({ does: "copy", ids }); }
  };

  useKeys({
    undo: () => void undo(), redo: () => void redo(), sheet: () => setKeys(true),
    remove: () => changes.remove(selection),
    escape: () => { if (tool) arm(null); else if (tour) closeTour(); else select([]); },
    copy: copyTool,
    move: () => { if (selection.length > 0) { setStep("actors"); arm({ does: "move", ids: selection }); } },
    selectAll: () => { setStep("actors"); select(ones.map((each) => each.id)); },
    tool: (n) => {
      setStep("actors");
      const category = CATEGORIES[n];
      arm(category ? { does: "place", category } : { does: "stream", walk: n > CATEGORIES.length });
    },
  });

  const errors = problems.filter((problem) => problem.severity === "error").length;
  const kept = step === "region" && hoverSegment !== null && roi.inside.includes(graph.segmentId(hoverSegment))
    && !roi.removable.includes(graph.segmentId(hoverSegment));
  const pointed = step === "traffic" && hoverSegment !== null ? `Tables call this ${graph.segmentId(hoverSegment)}` : null;
  const hint = pointed ?? (kept ? "This segment holds the region together and cannot be taken out"
    : hintFor(step, document.roi.length, tool, hover, graph));
  return (
    <div className="editor">
      <HeadTools store={store} onKeys={() => setKeys(true)} onTour={() => setTour(true)} />
      <div className="side">
        <Steps open={step} onOpen={openStep} steps={{
          map: {
            title: "Map", done: true, note: document.map.name,
            body: <MapStep name={document.map.name} onShow={() => handle.current?.show(drawing.bounds)} />,
          },
          region: {
            title: "Region", done: document.roi.length > 0,
            note: document.roi.length ? count(document.roi.length, "segment") : "Where does it happen?",
            body: <RegionStep segments={document.roi.length} roi={roi} onNext={() => openStep("environment")} onShow={showRegion}
              onBegin={() => handle.current?.pickMiddle()}
              onAll={() => changes.change(roi.candidates.map((segment): Edit => ({ kind: "grow_roi", segment })), `Add ${count(roi.candidates.length, "segment")}`)} />,
          },
          environment: {
            title: "Weather and time", done: document.roi.length > 0, note: weatherNote(assets, document.environment.preset),
            body: assets
              ? <><EnvironmentStep assets={assets} document={document} onEdit={changes.change} />
                <Button onClick={() => openStep("actors")}>Next: road users</Button></>
              : <Loader size="sm" aria-label="Loading the weather" />,
          },
          actors: {
            title: "Road users", done: ones.length > 0, note: actorNote(document),
            body: document.roi.length === 0
              ? <><Text size="sm">Road users start inside the region. Choose the region first.</Text>
                <Button onClick={() => openStep("region")}>Choose the region</Button></>
              : <><ActorStep assets={assets} graph={graph} starts={starts} selected={selected} tool={tool} goals={goals}
                  actors={document.actors.length} profiles={profiles} filling={filling} onTool={arm} onPlaceSomewhere={placeSomewhere} onEdit={changes.change}
                  onStart={changes.setStart} onGoal={changes.setGoal} onRemove={() => changes.remove(selection)}
                  onSelect={select} onShowGoals={showGoals} onFill={fill} />
                {ones.length > 0 && <Button variant="default" onClick={() => openStep("traffic")}>Next: traffic</Button>}</>,
          },
          traffic: {
            title: "Traffic", done: bringsSomebody(document.demand), note: trafficNote(document.demand),
            body: <><TrafficStep store={store} document={document} roads={roads} profiles={profiles} onEdit={changes.change} onShow={showSegments} />
              <Button onClick={() => openStep("run")}>Next: run</Button></>,
          },
          run: {
            title: "Run", done: false, note: errors ? count(errors, "problem") + " to solve first" : "Watch it live",
            body: <RunStep name={name} version={scenario.version} document={document} lights={drawing.symbols.some(([kind]) => kind.includes("light"))}
              blocked={errors > 0} busy={run.busy} empty={ones.length === 0 && !bringsSomebody(document.demand)} onEdit={changes.change} onRun={run.start} />,
          },
        }} />
        <Problems problems={problems} onShow={showProblem} />
      </div>
      <div className="stage">
        <div className="stage-map">
          <MapCanvas
            drawing={drawing} graph={graph} picker={picker} scene={scene} handle={handle}
            label={`Map ${document.map.name}`} aim={tool !== null || step === "region"}
            onPick={(at) => { if (step === "region") pickSegment(at); else if (step !== "traffic") { setStep("actors"); pickOne(at); } }}
            onPoint={point} onDrop={drop}
            onGrab={(at) => {
              carried.current = naming || tool ? null : oneAt(at);
              return carried.current !== null;
            }}
            onFrame={(frame) => { if (!naming) { setStep("actors"); select(inFrame([...actors, ...flows], frame)); } }}
          >
            {hint && <div className="map-hint" role="status">{hint}</div>}
            <Legend step={step} />
          </MapCanvas>
          {tour && <Tour onClose={closeTour} />}
        </div>
        {ones.length > 0 && (step === "actors" || step === "run") && (
          <RoadUserTable ones={ones} graph={graph} selection={selection} onRemove={changes.remove}
            onSelectAll={(ids) => { setStep("actors"); select(ids); }}
            onSelect={(id, more) => {
              setStep("actors");
              choose(id, more);
              const place = graph.place(ones.find((each) => each.id === id)?.spawn ?? "");
              if (place) handle.current?.centre(place.x, place.y);
            }} />
        )}
      </div>
      <RefusalAlert store={store} />
      <KeySheet open={keys} onClose={() => setKeys(false)} />
    </div>
  );
}
