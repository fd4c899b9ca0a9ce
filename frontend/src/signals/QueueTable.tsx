import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { lengthText } from "../language/units";
import type { ApproachNames } from "../map/placeNames";
import type { Queue } from "./queues";

/** Who waits now, by approach. */
export function QueueTable({ queues, names }: { queues: readonly Queue[]; names: ApproachNames }) {
  return (
    <table className="signal-table" aria-label={t`Queues now`}>
      <thead>
        <tr>
          <th scope="col">
            <Trans>Approach</Trans>
          </th>
          <th scope="col">
            <Trans>Queued</Trans>
          </th>
          <th scope="col">
            <Trans>Back of queue</Trans>
          </th>
        </tr>
      </thead>
      <tbody>
        {queues.map(({ approach, vehicles, metres }) => (
          <tr key={approach}>
            <th scope="row">{names.approach(approach)}</th>
            <td>{vehicles}</td>
            <td>{vehicles > 0 ? lengthText(metres) : "–"}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
