import { t } from "@lingui/core/macro";

import { type Editing, type Handler, LOOKING } from "./handler";
import { rowsWithin } from "../regions";
import { segmentAt, segmentHover } from "./segments";

/** Lets the region of interest grow and shrink, segment by segment, by a rectangle or by a line around it. */
export const regionHandler = ({ graph, picker, roi, region, changes }: Editing): Handler => ({
  ...LOOKING,
  aim: true,
  under: (at) => segmentHover(picker, at),
  hint: (hover) => {
    const segment = hover?.is === "segment" ? graph.segmentId(hover.row) : null;
    if (segment !== null && region.inside.includes(segment) && !region.removable.includes(segment)) {
      return t`This segment holds the region together and cannot be removed`;
    }
    return roi.length === 0
      ? t`Click a road or junction to begin the region, or drag a rectangle with Shift, a line around it with Ctrl`
      : null;
  },
  frame: (area) => changes.extendRegion(rowsWithin(graph, area)),
  pick: (at) => {
    const row = segmentAt(picker, at);
    if (row === null) return;
    const segment = graph.segmentId(row);
    changes.change({ kind: roi.includes(segment) ? "shrink_roi" : "grow_roi", segment });
  },
});
