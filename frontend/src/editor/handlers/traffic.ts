import { t } from "@lingui/core/macro";

import { type Editing, type Handler, LOOKING } from "./handler";
import { segmentHover } from "./segments";

/** Shows the ids of segments, which tables of trips and counts use. */
export const trafficHandler = ({ graph, picker }: Editing): Handler => ({
  ...LOOKING,
  under: (at) => segmentHover(picker, at),
  hint: (hover) => (hover?.is === "segment" ? t`Id for tables: ${graph.segmentId(hover.row)}` : null),
});
