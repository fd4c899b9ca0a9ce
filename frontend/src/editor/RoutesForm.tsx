import { Select, Text } from "@mantine/core";

import type { RouteChoice } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { count } from "../ui/words";
import { Committed } from "./Committed";

/** How trips choose their routes: by length or travel time, and who looks for others on the way. */
export function RoutesForm({ routes, onEdit }: { routes: RouteChoice; onEdit: (edit: Edit) => void }) {
  const change = (fields: FieldsOf<"set_routes", never>): void => onEdit({ kind: "set_routes", ...fields });
  return (
    <section className="fold" aria-label="Routes of trips">
      <Select
        label="Routes of trips"
        data={[
          { value: "length", label: "Shortest" },
          { value: "travel_time", label: "By travel time, from repeated runs" },
        ]}
        value={routes.by}
        allowDeselect={false}
        onChange={(by) => {
          if ((by === "length" || by === "travel_time") && by !== routes.by) change({ by });
        }}
      />
      {routes.by === "travel_time" && (
        <Committed
          label="Runs at most"
          suffix=""
          min={1}
          max={100}
          digits={0}
          value={routes.iterations}
          onCommit={(iterations) => change({ iterations: iterations ?? 20 })}
        />
      )}
      <Committed
        label="Drivers who look for quicker routes on the way"
        suffix=" %"
        min={0}
        max={100}
        digits={0}
        value={100 * routes.informed}
        onCommit={(share) => change({ informed: (share ?? 0) / 100 })}
      />
      {routes.shares.length > 0 && (
        <Text size="xs" c="dimmed">
          Fixed shares of routes for {count(routes.shares.length, "pair")} of places
        </Text>
      )}
    </section>
  );
}
