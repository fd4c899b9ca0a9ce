import { useCallback, useState } from "react";

import { type Assets, CATEGORIES, type MapDetails } from "../api/types";
import { signals } from "../api/signals";
import type { PackedDrawing } from "../map/drawing";
import type { LoadedGraph } from "../map/loaded";
import { SignalPanel } from "../signals/SignalPanel";
import { EditorSteps } from "./EditorSteps";
import { copyTool } from "./handlers/copy";
import { flowTool } from "./handlers/flow";
import { moveTool } from "./handlers/move";
import { placeTool } from "./handlers/place";
import { HeadTools } from "./HeadTools";
import { HelpSheet } from "./HelpSheet";
import { useKeys } from "./keys";
import { isFlow } from "./placing";
import { Problems } from "./Problems";
import { RefusalAlert } from "./RefusalAlert";
import { Stage } from "./Stage";
import type { EditorStore } from "./store";
import { firstVisit, Tour, tourSeen } from "./Tour";
import { useEditing } from "./useEditing";

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
  const { undo, redo } = store();
  const { scenario } = now;
  // Anew with each version of the scenario: any edit may have changed the program.
  const loadProgram = useCallback(
    (junction: string) => signals.ofScenario(scenario.name, junction),
    [scenario],
  );
  const [help, setHelp] = useState(false);
  const [tour, setTour] = useState(firstVisit);
  const closeTour = (): void => {
    tourSeen();
    setTour(false);
  };
  const { ones, selection, select, arm, tool } = now;
  useKeys({
    undo: () => void undo(),
    redo: () => void redo(),
    sheet: () => setHelp(true),
    remove: () => now.changes.remove(selection),
    escape: () => {
      if (now.pick.now) now.pick.stop();
      else if (tool) arm(null);
      else if (tour) closeTour();
      else select([]);
    },
    copy: () => {
      const ids = ones.filter((one) => !isFlow(one) && selection.includes(one.id)).map(({ id }) => id);
      if (ids.length > 0) arm(copyTool(ids));
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
      <HeadTools store={store} onHelp={() => setHelp(true)} onTour={() => setTour(true)} />
      <div className="side">
        <EditorSteps store={store} now={now} drawing={drawing} assets={assets} />
        <Problems problems={now.problems} onShow={now.showProblem} />
      </div>
      <Stage now={now} drawing={drawing}>
        {now.light && now.lights && (
          <SignalPanel
            junctions={now.lights.junctions}
            junction={now.light}
            onJunction={now.showLight}
            load={loadProgram}
            onClose={now.closeLight}
          />
        )}
        {tour && <Tour onClose={closeTour} />}
      </Stage>
      <RefusalAlert store={store} />
      <HelpSheet open={help} onClose={() => setHelp(false)} />
    </div>
  );
}
