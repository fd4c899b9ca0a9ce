import { Button, Group, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { Actor, Edit } from "../api/types";
import type { Graph } from "../map/graph";
import { abreast, evenly, inTurn } from "./arrange";
import { Committed } from "./Committed";
import type { Moves, Starts } from "./placing";

/** Puts several road users in order, on the road and in time; each is one step for undo. */
export function ArrangeForm({
  actors,
  graph,
  starts,
  onEdit,
}: {
  actors: readonly Actor[];
  graph: Graph;
  starts: Starts;
  onEdit: (edits: readonly Edit[], label: string) => void;
}) {
  const move = (moves: Moves, label: string): void => {
    if (moves.length > 0)
      onEdit(
        moves.map(([actor, spawn]) => ({ kind: "move_actor", actor, spawn })),
        label,
      );
  };
  const even = evenly(graph, starts, actors);
  return (
    <div role="group" aria-label={t`Arrange`}>
      <Text size="sm" fw={500}>
        <Trans>Arrange</Trans>
      </Text>
      <Group gap={6} mt={4}>
        <Button
          size="compact-sm"
          variant="default"
          onClick={() => move(abreast(graph, starts, actors), t`Align ${actors.length} road users`)}
        >
          <Trans>Beside the first</Trans>
        </Button>
        <Button
          size="compact-sm"
          variant="default"
          disabled={even === null}
          title={even === null ? t`At least three on the same lane` : undefined}
          onClick={() => move(even ?? [], t`Distribute ${actors.length} road users`)}
        >
          <Trans>Evenly along the lane</Trans>
        </Button>
      </Group>
      <Committed
        label={t`Depart one after another, every`}
        suffix={" s"}
        min={0}
        max={3600}
        digits={1}
        placeholder={t`not set`}
        value=""
        onCommit={(apart) => {
          if (apart !== null)
            onEdit(
              inTurn(actors, apart).map(([actor, depart]) => ({ kind: "change_actor", actor, depart })),
              t`Departures of ${actors.length} road users`,
            );
        }}
      />
    </div>
  );
}
