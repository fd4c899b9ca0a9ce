import { plural, t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import type { Facts } from "../api/removal";

const KEPT = localized(() => t`It stays in the wastebasket for 30 days and can be restored.`);

/** What depends on something that is to be removed, in sentences. */
export function factsWords({ kind, scenarios, runs, live }: Facts): string[] {
  if (kind === "run") {
    if (live) return [t`This run is live. Stop it first.`];
    return [t`Its figures, its recording and its report go with it. The scenario stays.`, KEPT()];
  }
  const going = live === 0 ? "" : live === 1 ? t`, 1 of them live` : t`, ${live} of them live`;
  const ran = `${plural(runs, { one: "# run", other: "# runs" })}${going}`;
  const finish = live === 0 ? [] : [t`Live runs still end with their report.`];
  if (kind === "scenario")
    return [runs ? t`It has ${ran}. They stay.` : t`It has no runs.`, ...finish, KEPT()];
  if (!scenarios && !runs) return [t`Nothing was made on this map.`, KEPT()];
  return [
    t`${plural(scenarios, { one: "# scenario", other: "# scenarios" })} and ${ran} were made on this map. They stay, but the scenarios need it to run.`,
    ...finish,
    KEPT(),
  ];
}
