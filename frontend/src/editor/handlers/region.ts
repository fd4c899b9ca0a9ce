import { t } from "@lingui/core/macro";

import type { Pointed } from "../../map/MapCanvas";
import { rowsWithin } from "../regions";
import { type Editing, type Handler, LOOKING } from "./handler";
import { lightHover, lightWords } from "./lights";
import { segmentAt, segmentHover } from "./segments";

/** Lets the region of interest grow and shrink, segment by segment, by a rectangle or by a line around it. */
export function regionHandler(editing: Editing): Handler {
  const { graph, picker, roi, region, lights, changes } = editing;
  /** The light at whose signal one points, where the click would take its junction out of the region. */
  const lightAt = (at: Pointed): string | null => {
    const row = segmentAt(picker, at);
    const taken = row !== null && roi.includes(graph.segmentId(row));
    return taken ? (lights?.junctionAt({ ...at, reach: 0 }) ?? null) : null;
  };
  return {
    ...LOOKING,
    aim: true,
    under: (at) => lightHover(lightAt(at)) ?? segmentHover(picker, at),
    hint: (hover) => {
      if (hover?.is === "light") return lightWords(hover, graph.names);
      const segment = hover?.is === "segment" ? graph.segmentId(hover.row) : null;
      if (segment !== null && region.inside.includes(segment))
        return region.removable.includes(segment)
          ? t`Click to take this segment out of the region`
          : t`This segment holds the region together and cannot be removed`;
      return roi.length === 0
        ? t`Click a road or junction to begin the region, or drag a rectangle with Shift, a line around it with Ctrl`
        : null;
    },
    frame: (area) => changes.extendRegion(rowsWithin(graph, area)),
    pick: (at) => {
      const light = lightAt(at);
      if (light !== null) {
        editing.openStep("lights");
        editing.showLight(light);
        return;
      }
      const row = segmentAt(picker, at);
      if (row === null) return;
      const segment = graph.segmentId(row);
      changes.change({ kind: roi.includes(segment) ? "shrink_roi" : "grow_roi", segment });
    },
  };
}
