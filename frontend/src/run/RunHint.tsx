import { Loader } from "@mantine/core";

import { t } from "@lingui/core/macro";
import type { RunInfo } from "../api/runs";
import { served } from "../language/served";

/** What is said on the map of a run: how its preparation goes, or who is followed. */
export function RunHint({
  info,
  lost,
  planned,
  followed,
  there,
}: {
  /** Null where another view says how the preparation goes. */
  info: Pick<RunInfo, "state" | "preparing"> | null;
  /** Whether the server does not answer. */
  lost: boolean;
  /** Whether all road users are known, for their routes are planned. */
  planned: boolean;
  followed: string | null;
  /** Whether that one is on the road. */
  there: boolean;
}) {
  if (lost)
    return (
      <div className="map-hint" role="status">
        <span className="waiting">
          <Loader size={16} aria-hidden="true" />
          {t`The server does not answer. What is shown resumes as soon as it is back …`}
        </span>
      </div>
    );
  if (info?.state === "preparing")
    return (
      <div className="map-hint" role="status">
        <span className="waiting">
          <Loader size={16} aria-hidden="true" />
          {planned
            ? t`Preparing, step 2 of 2: starting the simulation …`
            : t`Preparing, step 1 of 2: planning the routes … ${served(info.preparing ?? "")}`}
        </span>
      </div>
    );
  if (followed === null) return null;
  return (
    <div className="map-hint" role="status">
      {there
        ? t`Following ${followed}. Click on the empty map to stop.`
        : t`${followed} is not on the road now.`}
    </div>
  );
}
