import { Select, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import type { RouteChoice } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { Committed } from "./Committed";

/** How trips choose their routes: by length or travel time, and who looks for others on the way. */
export function RoutesForm({ routes, onEdit }: { routes: RouteChoice; onEdit: (edit: Edit) => void }) {
  const change = (fields: FieldsOf<"set_routes", never>): void => onEdit({ kind: "set_routes", ...fields });
  return (
    <section className="fold" aria-label={t`Routes of trips`}>
      <Select
        label={t`Routes of trips`}
        data={[
          { value: "length", label: t`Shortest` },
          { value: "travel_time", label: t`By travel time, from repeated runs` },
        ]}
        value={routes.by}
        allowDeselect={false}
        onChange={(by) => {
          if ((by === "length" || by === "travel_time") && by !== routes.by) change({ by });
        }}
      />
      {routes.by === "travel_time" && (
        <Committed
          label={t`Runs at most`}
          suffix=""
          min={1}
          max={100}
          digits={0}
          value={routes.iterations}
          onCommit={(iterations) => change({ iterations: iterations ?? 20 })}
        />
      )}
      <Committed
        label={t`Share of drivers rerouting en route`}
        suffix=" %"
        min={0}
        max={100}
        digits={0}
        value={100 * routes.informed}
        onCommit={(share) => change({ informed: (share ?? 0) / 100 })}
      />
      {routes.shares.length > 0 && (
        <Text size="xs" c="dimmed">
          <Trans>
            Fixed shares of routes for <Plural value={routes.shares.length} one="# pair" other="# pairs" /> of
            places
          </Trans>
        </Text>
      )}
    </section>
  );
}
