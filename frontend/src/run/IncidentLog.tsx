import { i18n } from "@lingui/core";
import { Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { Incident } from "../api/runs";
import type { Category } from "../api/types";
import { MARK_COLOR } from "../map/colors";
import { clock } from "../language/moments";
import { markKind, sentence } from "./incidents";

const LISTED = 200;

/** Incidents, the newest first; a click shows where. */
export function IncidentLog({
  incidents,
  categories,
  over,
  onShow,
}: {
  incidents: readonly Incident[];
  categories: ReadonlyMap<string, Category>;
  over: boolean;
  onShow: (incident: Incident) => void;
}) {
  if (incidents.length === 0) {
    return (
      <Text size="sm" c="dimmed">
        {over
          ? t`There were no incidents.`
          : t`No incidents so far. Collisions, emergency braking and teleported vehicles (removed after waiting too long) appear here.`}
      </Text>
    );
  }
  // What lasted is known at its end, after what came in between.
  const listed = [...incidents]
    .sort((one, other) => one.time - other.time)
    .slice(-LISTED)
    .reverse();
  return (
    <>
      <Text size="sm" c="dimmed">
        <Trans>Choose one to see where it happened.</Trans>
      </Text>
      <ul className="rows" aria-label={t`Incidents`}>
        {listed.map((one, n) => (
          <li key={incidents.length - n}>
            <button type="button" onClick={() => onShow(one)}>
              <i className="mark" style={{ background: MARK_COLOR[markKind(one)] }} />
              <time>{clock(one.time)}</time>
              <span>{sentence(one, categories)}</span>
            </button>
          </li>
        ))}
      </ul>
      {incidents.length > LISTED && (
        <Text size="sm" c="dimmed" mt="xs">
          <Trans>
            {(incidents.length - LISTED).toLocaleString(i18n.locale)} earlier ones are in the report.
          </Trans>
        </Text>
      )}
    </>
  );
}
