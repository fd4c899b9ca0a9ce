import { t } from "@lingui/core/macro";
import { type RefObject, useCallback, useEffect, useMemo, useRef, useState } from "react";

import type { Assets, MapDetails, Problem, ScenarioDocument, ScenarioState } from "../api/types";
import { countFrom } from "../language/moments";
import type { LoadedGraph } from "../map/loaded";
import type { MapHandle } from "../map/MapCanvas";
import type { LightProgram } from "../api/signals";
import { Heads } from "../signals/heads";
import { keep, parseKept } from "../ui/kept";
import { tell } from "../ui/notices";
import { useGoals, useRegion, useTrial } from "./asked";
import { changesOf } from "./changes";
import { handlerFor } from "./handlers";
import type { Editing, Handler, Hover, Tool } from "./handlers/handler";
import { usePick } from "./pick";
import { placeWord } from "./placeWords";
import type { Draft } from "./rules/draft";
import { namePlaces } from "./rules/fields";
import { everyone } from "./placing";
import { bodyOf, firstStep, ofProblem, type Step, STEPS, wrongOnes } from "./scene";
import { type Sights, sightsOf } from "./sights";
import type { AskedRemoval } from "./uses";
import type { EditorStore } from "./store";
import { useShown } from "./useShown";

/** The state of the editor: what is open, selected and in the hand, and who is in charge of the map. */
export interface EditorNow extends Editing {
  scenario: ScenarioState;
  document: ScenarioDocument;
  problems: readonly Problem[];
  setProgram: (program: LightProgram | null) => void;
  /** The rule whose form is open, as it is there. */
  drafted: Draft | null;
  setDrafted: (draft: Draft | null) => void;
  closeLight: () => void;
  /** Road users that are to be removed though something uses them. */
  removal: AskedRemoval | null;
  setRemoval: (removal: AskedRemoval | null) => void;
  step: Step;
  tool: Tool | null;
  /** Takes a tool into the hand, or puts it back. */
  arm: (tool: Tool | null) => void;
  /** Uses the tool without the map. */
  placeSomewhere: () => void;
  handler: Handler;
  hover: Hover | null;
  setHover: (hover: Hover | null) => void;
  /** Rows of the segments of the region. */
  inside: ReadonlySet<number>;
  route: readonly (readonly [number, number])[];
  /** Whether no route leads between start and goal as they are being chosen. */
  unreachable: boolean;
  showProblem: (problem: Problem) => void;
  /** Brings a segment, or a road user that is selected then, into sight. */
  show: (is: "segment" | "one", id: string) => void;
  sights: Sights;
  handle: RefObject<MapHandle | null>;
}

const POINTED: ReadonlySet<keyof EditorNow> = new Set(["hover", "route", "unreachable", "handler"]);

/**
 * Whether two states differ at most in what lies under the pointer. Functions are left out: what
 * they know is compared.
 */
export const sameButPointer = (one: EditorNow, other: EditorNow): boolean =>
  (Object.keys(one) as (keyof EditorNow)[]).every(
    (key) => POINTED.has(key) || typeof one[key] === "function" || one[key] === other[key],
  );

const NONE: Editing["detectors"] = [];
/** Pixels of the right of the map that the program of a light covers. */
const PROGRAM = 430;

export function useEditing(
  store: EditorStore,
  loaded: LoadedGraph,
  assets: Assets | null,
  map: MapDetails | null,
): EditorNow {
  const { graph, picker } = loaded;
  const { scenario, checked, selection, name, edit, select } = store();
  if (!scenario) throw new Error(t`the editor is only shown with a scenario`);
  const { document, problems } = scenario;
  // What is shown below says moments as times of day if there is a clock.
  countFrom(document.demand.clock, document.simulation.duration);
  namePlaces((node) => placeWord(graph, node), graph.names);
  const [step, setStep] = useState<Step>(() => keptStep() ?? firstStep(document));
  // A link selects who was selected when it was copied.
  useEffect(() => {
    const known = new Set(everyone(document).map(({ id }) => id));
    const chosen = parseKept(location.hash).chosen?.filter((id) => known.has(id)) ?? [];
    if (chosen.length > 0) select(chosen);
    // Only when the editor is opened.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, []);
  useEffect(() => keep({ step, chosen: selection }), [step, selection]);
  const [tool, setTool] = useState<Tool | null>(null);
  const [hover, setPointed] = useState<Hover | null>(null);
  // The same place is another object with every move of the pointer.
  const setHover = useCallback(
    (next: Hover | null) => setPointed((old) => (JSON.stringify(old) === JSON.stringify(next) ? old : next)),
    [],
  );
  const handle = useRef<MapHandle | null>(null);
  const lights = useMemo(() => map && new Heads(map.lights), [map]);
  const [removal, setRemoval] = useState<AskedRemoval | null>(null);
  const [drafted, setDrafted] = useState<Draft | null>(null);
  const [light, setLight] = useState<string | null>(null);
  const [program, setProgram] = useState<LightProgram | null>(null);

  const roiKey = document.roi.join("\n");
  const region = useRegion(name, roiKey, scenario.version);
  // That of the server: where one can go is asked of it.
  const saidRoi = useMemo(() => region.inside.join("\n"), [region]);
  const { actors: placed, flows: sent } = document;
  const ones = useMemo(() => everyone({ actors: placed, flows: sent }), [placed, sent]);
  const one = useMemo(
    () => (selection.length === 1 ? (ones.find(({ id }) => id === selection[0]) ?? null) : null),
    [ones, selection],
  );
  const { goals, legs } = useGoals(name, one, saidRoi, graph);
  const trial = (hover?.is === "place" && hover.trial) || null;
  const tried = useTrial(name, trial);
  const route = useMemo(() => (trial ? tried.points : legs.flat()), [trial, tried, legs]);
  const wrong = useWrong(problems, checked ?? document);
  const { inside, starts, actors, flows } = useShown(loaded, document, assets, selection, wrong);
  const sights = useMemo(() => sightsOf(handle, graph, () => lights), [graph, lights]);
  const { roi } = document;
  const changes = useMemo(
    () => changesOf({ graph, document, roi, ones, starts, edit, say: tell, ask: setRemoval }),
    [graph, document, roi, ones, starts, edit],
  );

  const pick = usePick();
  const goTo = (next: Step): void => {
    if (next !== step) {
      setHover(null);
      pick.stop();
    }
    setStep(next);
  };
  const arm = (next: Tool | null): void => {
    setTool(next);
    setHover(null);
    if (next) goTo("actors");
    if (next?.makes) select([]);
  };
  const names = map?.lights.find((one) => light !== null && one.names.includes(light))?.names ?? [];
  const editing: Editing = {
    light,
    program,
    detectors: document.signals.junctions.find(({ junction }) => names.includes(junction))?.detectors ?? NONE,
    graph,
    picker,
    roi: document.roi,
    region,
    ones,
    actors,
    flows,
    starts,
    sizeOf: (category) => bodyOf({ category, model: null, size: null }, assets),
    selection,
    one,
    goals,
    legs,
    lights,
    showLight: (junction) => {
      const middle = lights?.middle(junction);
      if (middle) handle.current?.centre(middle.x, middle.y, PROGRAM / 2);
      setLight(junction);
    },
    changes,
    pick,
    select,
    openStep: (next) => {
      goTo(next);
      arm(null);
      if (next === "actors") sights.segments(document.roi);
    },
    openActors: () => goTo("actors"),
    done: () => arm(null),
    say: tell,
  };
  return {
    ...editing,
    scenario,
    document,
    problems,
    setProgram,
    drafted,
    setDrafted,
    closeLight: () => {
      setLight(null);
      pick.stop();
    },
    removal,
    setRemoval,
    step,
    tool,
    arm,
    hover,
    setHover,
    inside,
    route,
    unreachable: trial !== null && tried.possible === false,
    sights,
    handle,
    handler: handlerFor(step, tool, editing),
    placeSomewhere: () => tool?.handler(editing).somewhere(),
    show: (is, id) => {
      const found = is === "one" ? ones.find((each) => each.id === id) : undefined;
      if (is === "segment") sights.segments([id]);
      if (!found) return;
      goTo("actors");
      select([id]);
      sights.close(found);
    },
    showProblem: (problem) => {
      const about = ofProblem(problem, checked ?? document);
      if (about) select([about.id]);
      goTo(about ? "actors" : (stepOf(problem) ?? step));
      sights.problem(problem, checked ?? document);
    },
  };
}

/** Ids of those that cannot be run as they are: the same set as long as it has the same ids. */
function useWrong(problems: readonly Problem[], checked: ScenarioDocument): ReadonlySet<string> {
  const found = useMemo(() => [...wrongOnes(problems, checked)].join("\n"), [problems, checked]);
  return useMemo(() => new Set(found ? found.split("\n") : []), [found]);
}

/** The step that the address names, if it names one. */
const keptStep = (): Step | undefined => STEPS.find((one) => one === parseKept(location.hash).step);

/** Where a problem is solved that is not about one road user. */
function stepOf({ where }: Problem): Step | null {
  if (where.startsWith("roi")) return "region";
  if (where.startsWith("measures")) return "measures";
  if (where.startsWith("rules")) return "rules";
  if (where.startsWith("study")) return "study";
  if (where.startsWith("criteria")) return "criteria";
  if (where.startsWith("transit")) return "transit";
  return where.startsWith("demand") ? "traffic" : null;
}
