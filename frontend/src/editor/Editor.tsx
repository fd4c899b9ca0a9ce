import { VisuallyHidden } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import { type Assets, CATEGORIES, type MapDetails } from "../api/types";
import { signals } from "../api/signals";
import type { PackedDrawing } from "../map/drawing";
import type { Place } from "../map/graph";
import type { LoadedGraph } from "../map/loaded";
import { signalEditing } from "../signals/editing";
import { SignalPanel } from "../signals/SignalPanel";
import { useStarter } from "./asked";
import { bringsTraffic } from "./demand";
import { commandsOf } from "./commands";
import { go } from "../ui/address";
import { EditorSteps, type Hindrance, STEP_TITLE } from "./EditorSteps";
import { copyTool } from "./handlers/copy";
import { flowTool } from "./handlers/flow";
import { goalTool } from "./handlers/goal";
import { moveTool } from "./handlers/move";
import { placeTool } from "./handlers/place";
import { waypointTool } from "./handlers/waypoint";
import { FindDialog } from "./FindDialog";
import { HeadTools } from "./HeadTools";
import { HelpSheet } from "./HelpSheet";
import { useKeys } from "./keys";
import { isFlow } from "./placing";
import { boundsOfPlaces, isScene, type Step, STEPS } from "./scene";
import { around } from "./sights";
import { Problems } from "./Problems";
import { RemoveUsed } from "./RemoveUsed";
import { RefusalAlert } from "./RefusalAlert";
import { Stage } from "./Stage";
import type { EditorStore } from "./store";
import { fit, type View } from "../map/view";
import { useRunChoices } from "./runChoices";
import { firstVisit, Tour, tourSeen } from "./Tour";
import { useAskBeforeClosing, useFinishedOnLeaving } from "../ui/leaving";
import { type EditorNow, useEditing } from "./useEditing";

/** Pixels per metre from which on a car is well seen. */
const LEGIBLE = 3;
/** Metres around the starts of a scene. */
const SCENE_MARGIN = 30;

/** The editor of one scenario: its steps, its map and its table, and the keys that hold in all of them. */
export function Editor({
  store,
  drawing,
  loaded,
  assets,
  map,
}: {
  store: EditorStore;
  drawing: PackedDrawing;
  loaded: LoadedGraph;
  assets: Assets | null;
  map: MapDetails | null;
}) {
  const now = useEditing(store, loaded, assets, map);
  const { undo, redo, saving, refusal } = store();
  const { scenario } = now;
  // Anew with each version of the scenario: any edit may have changed the program.
  const { name, version } = scenario;
  const loadProgram = useCallback(
    (junction: string) => signals.ofScenario(name, junction),
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [name, version],
  );
  const { light, pick } = now;
  const lightEditing = useMemo(() => {
    if (!light) return null;
    const names = map?.lights.find((one) => one.names.includes(light))?.names ?? [light];
    return signalEditing(store, scenario, light, names, pick);
  }, [store, scenario, light, map, pick]);
  useFinishedOnLeaving();
  useAskBeforeClosing(refusal?.again != null);
  const [help, setHelp] = useState(false);
  const [finding, setFinding] = useState(false);
  const [tour, setTour] = useState(firstVisit);
  const openHelp = useCallback(() => setHelp(true), []);
  const openFinding = useCallback(() => setFinding(true), []);
  const openTour = useCallback(() => setTour(true), []);
  const { handle } = now;
  const picture = useCallback(() => handle.current?.picture() ?? null, [handle]);
  const vector = useCallback(() => handle.current?.vector() ?? null, [handle]);
  const closeTour = (): void => {
    tourSeen();
    setTour(false);
  };
  const { ones, selection, select, arm, tool } = now;
  const choices = useRunChoices(name, scenario.document.simulation.duration);
  const starter = useStarter(name);
  const hindrance = hindranceOf(now);
  const run = useLatest(() => {
    if (hindrance) {
      const [step, words] = wantedFirst(now, hindrance);
      now.openStep(step);
      now.say(words);
    } else starter.start(choices.started, placeOfRun(now, handle.current?.view() ?? null));
  });
  const copied = useRef<readonly string[]>([]);
  const moveTo = (place: Place | null): void => {
    if (now.one && place) now.changes.setStart(now.one, place.id);
  };
  useKeys({
    undo: () => void undo(),
    redo: () => void redo(),
    sheet: openHelp,
    find: openFinding,
    run,
    remove: () => now.changes.remove(selection),
    escape: () => {
      if (now.pick.now) now.pick.stop();
      else if (tool) arm(null);
      else if (tour) closeTour();
      else select([]);
    },
    copy: () => {
      const ids = ones.filter((one) => !isFlow(one) && selection.includes(one.id)).map(({ id }) => id);
      if (ids.length === 0) return;
      copied.current = ids;
      arm(copyTool(ids));
    },
    paste: () => {
      const ids = copied.current.filter((id) => ones.some((one) => one.id === id));
      if (ids.length > 0) arm(copyTool(ids));
    },
    goal: () => {
      if (now.one) arm(goalTool(now.one.id));
    },
    waypoint: () => {
      if (now.one && !isFlow(now.one)) arm(waypointTool(now.one.id));
    },
    along: (by) => {
      const start = now.one && now.graph.place(now.one.spawn);
      moveTo(start ? now.starts.along(start, by) : null);
    },
    lane: () => {
      const start = now.one && now.graph.place(now.one.spawn);
      moveTo(start ? now.starts.otherLane(start) : null);
    },
    move: () => {
      if (selection.length > 0) arm(moveTool(selection));
    },
    selectAll: () => {
      now.openActors();
      select(ones.map(({ id }) => id));
    },
    tool: (n) => {
      const category = CATEGORIES[n];
      arm(category ? placeTool(category) : flowTool(n > CATEGORIES.length));
    },
  });
  return (
    <div className="editor">
      <VisuallyHidden component="h1">{scenario.document.name}</VisuallyHidden>
      <HeadTools
        store={store}
        starting={starter.busy}
        onRun={run}
        onFind={openFinding}
        onHelp={openHelp}
        onTour={openTour}
        onPicture={picture}
        onVector={vector}
      />
      <div className="side">
        <EditorSteps
          store={store}
          now={now}
          drawing={drawing}
          assets={assets}
          choices={choices}
          hindrance={hindrance}
          starting={starter.busy}
          onRun={run}
        />
        <Problems problems={now.problems} graph={now.graph} onShow={now.showProblem} />
      </div>
      <Stage now={now} saving={saving === "saving"} drawing={drawing} assets={assets}>
        {now.light && now.lights && (
          <SignalPanel
            junctions={now.lights.junctions}
            junction={now.light}
            places={now.graph.names}
            onJunction={now.showLight}
            load={loadProgram}
            editing={lightEditing}
            onShown={now.setProgram}
            onClose={now.closeLight}
          />
        )}
        {tour && <Tour step={now.step} onClose={closeTour} />}
      </Stage>
      <RefusalAlert store={store} />
      {finding && (
        <FindDialog
          graph={now.graph}
          ones={ones}
          commands={commandsOf(
            {
              run,
              undo: () => void undo(),
              redo: () => void redo(),
              openStep: now.openStep,
              place: (category) => arm(placeTool(category)),
              placeFlow: (walks) => arm(flowTool(walks)),
              selectAll: () => {
                now.openActors();
                select(ones.map(({ id }) => id));
              },
              showAll: () => now.sights.bounds(drawing.bounds),
              showRegion: () => now.sights.segments(scenario.document.roi),
              runs: () => go({ view: "runs", scenario: name }),
              studies: () => go({ view: "studies" }),
              sweeps: () => go({ view: "sweeps", scenario: name }),
              catalogue: () => go({ view: "catalogue" }),
              help: openHelp,
              tour: openTour,
            },
            STEPS.map((step) => [step, STEP_TITLE()[step]] as const),
          )}
          onGo={({ is, id }) => now.show(is, id)}
          onClose={() => setFinding(false)}
        />
      )}
      {now.removal && (
        <RemoveUsed
          asked={now.removal}
          document={scenario.document}
          onRemove={(uses) => now.changes.remove(now.removal?.ids ?? [], uses)}
          onClose={() => now.setRemoval(null)}
        />
      )}
      <HelpSheet open={help} onClose={() => setHelp(false)} />
    </div>
  );
}

/** What keeps the scenario from being run now. */
function hindranceOf({ problems, ones, document: { demand, sumo } }: EditorNow): Hindrance | null {
  const errors = problems.filter(({ severity }) => severity === "error").length;
  const empty = ones.length === 0 && !bringsTraffic(demand) && !sumo;
  return errors > 0 || empty ? { errors, empty } : null;
}

/** What a run has in sight first: what the editor has, or who acts in a scene if they are not well in it. */
function placeOfRun({ document, graph, sights }: EditorNow, at: View | null): View | null {
  const seen = sights.seen();
  if (!isScene(document) || !at || !seen) return at;
  const starts = document.actors.flatMap(({ spawn }) => graph.place(spawn) ?? []);
  const [x0, y0, x1, y1] = seen;
  const within = starts.every(({ x, y }) => x >= x0 && x <= x1 && y >= y0 && y <= y1);
  if (starts.length === 0 || (within && at.scale >= LEGIBLE)) return at;
  const [w, h] = [(x1 - x0) * at.scale, (y1 - y0) * at.scale];
  return fit(around(boundsOfPlaces(starts), SCENE_MARGIN), { width: w, height: h });
}

/** The step in which the first thing that is missing for a run is to be done, and what that is. */
function wantedFirst({ document }: EditorNow, { errors, empty }: Hindrance): [Step, string] {
  if (document.roi.length === 0) return ["region", t`Choose the region first: click a road or a junction.`];
  if (empty) return ["actors", t`There are no road users yet: choose a kind, then click on the map.`];
  return [
    "run",
    t`${plural(errors, { one: "# problem", other: "# problems" })} to solve first; a click on one in the list shows where.`,
  ];
}

/** The same function always, which does what the newest one does. */
function useLatest(act: () => void): () => void {
  const latest = useRef(act);
  useEffect(() => {
    latest.current = act;
  });
  return useCallback(() => latest.current(), []);
}
