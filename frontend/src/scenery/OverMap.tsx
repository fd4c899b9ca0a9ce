import "./scenery.css";

import { Loader } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { lazy, type RefObject, Suspense } from "react";

import type { HeightColumns } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import type { Graph } from "../map/graph";
import type { Pointed } from "../map/MapCanvas";
import { OWN_POINTER } from "../map/ownPointer";
import type { View } from "../map/view";
import { tell } from "../ui/notices";
import type { Camera } from "./cameras";
import type { SceneryHandle } from "./SceneryView";

/** It has a library of its own, and comes when it is wanted. */
const SceneryView = lazy(() => import("./SceneryView"));

/** A view in three dimensions that lies over the plan of a map. */
export function OverMap({
  onFail,
  ...props
}: {
  drawing: PackedDrawing;
  graph: Graph;
  heights: HeightColumns;
  weather: Readonly<Record<string, number>>;
  camera: Camera;
  /** What part of the map is in sight first. */
  from: () => View | null;
  label: string;
  handle: RefObject<SceneryHandle | null>;
  onPick: (at: Pointed) => void;
  /** The browser cannot draw it, which has been said. */
  onFail: () => void;
  /** It has been made, and waits for what it is to show. */
  onReady: () => void;
}) {
  return (
    <div className="run-scenery" {...{ [OWN_POINTER]: "" }}>
      <Suspense fallback={<Loader aria-label={t`Loading the view in 3D`} />}>
        <SceneryView
          {...props}
          onFail={() => {
            tell(t`This browser cannot show three dimensions; here is the plan.`);
            onFail();
          }}
        />
      </Suspense>
    </div>
  );
}
