import { t } from "@lingui/core/macro";

import { type Editing, type Handler } from "./handler";
import { goalAt, oneAt } from "./select";

/** Besides what a handler does: a click on a traffic light shows its program. */
export function withLights(handler: Handler, editing: Editing): Handler {
  const { lights, showLight } = editing;
  return {
    ...handler,
    under: (at) => {
      const junction = lights?.junctionAt(at) ?? null;
      return junction === null ? handler.under(at) : { is: "light", junction };
    },
    hint: (hover) =>
      hover?.is === "light"
        ? t`Traffic light of junction ${hover.junction}: click to see its program`
        : handler.hint(hover),
    pick: (at) => {
      // Road users and goals that lie on a stop line come first.
      const junction = oneAt(editing, at) || goalAt(editing, at) ? null : lights?.junctionAt(at);
      if (junction) showLight(junction);
      else handler.pick(at);
    },
  };
}
