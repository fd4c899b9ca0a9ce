import { ActionIcon, Button, Group, Select, Text, Tooltip } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import type { Actor, Flow } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { IconTrash } from "../ui/icons";
import { placeWord } from "./placeWords";
import { isFlow, type Starts } from "./placing";

/** Start and goal: all that a click on the map does, without the map. */
export function StartAndGoal({
  one,
  graph,
  starts,
  goals,
  onStart,
  onGoal,
  onPickGoal,
  onVia,
  onPickVia,
}: {
  one: Actor | Flow;
  graph: Graph;
  starts: Starts;
  goals: readonly Place[] | null;
  onStart: (spawn: string) => void;
  onGoal: (goal: string | null) => void;
  /** Shows the goals that are suggested and lets one be chosen, or any other point. */
  onPickGoal: () => void;
  /** Changes the places that the route leads through; flows have none. */
  onVia: (via: string[]) => void;
  /** Lets one more of them be chosen. */
  onPickVia: () => void;
}) {
  const start = graph.place(one.spawn);
  const moves: [string, () => Place | null][] = start
    ? [
        [t`Move back`, () => starts.along(start, -1)],
        [t`Move forward`, () => starts.along(start, 1)],
        [t`Another lane`, () => starts.otherLane(start)],
      ]
    : [];
  const ids = (goals ?? []).map((goal) => goal.id);
  const all = one.goal && !ids.includes(one.goal) ? [one.goal, ...ids] : ids;
  return (
    <>
      <div>
        <Text size="sm" fw={500}>
          <Trans>Start</Trans>
        </Text>
        <Tooltip label={one.spawn} position="top-start">
          <Text size="sm">{placeWord(graph, one.spawn)}</Text>
        </Tooltip>
        <Group gap={6} mt={4} role="group" aria-label={t`Move the start`}>
          {moves.map(([word, find]) => (
            <Button
              key={word}
              size="compact-xs"
              variant="default"
              onClick={() => {
                const place = find();
                if (place) onStart(place.id);
              }}
            >
              {word}
            </Button>
          ))}
        </Group>
      </div>
      {!isFlow(one) && <Passed via={one.via} graph={graph} onVia={onVia} onPickVia={onPickVia} />}
      {goals?.length === 0 && !one.goal ? (
        <Text size="sm" c="red">
          <Trans>No goal can be reached from here. Move the start or extend the region.</Trans>
        </Text>
      ) : (
        <Group gap={6} align="flex-end">
          <Select
            style={{ flex: "1 1 170px" }}
            label={t`Goal`}
            searchable
            disabled={goals === null}
            allowDeselect={false}
            value={one.goal ?? ""}
            data={[
              { value: "", label: goals ? t`Random (one of ${goals.length})` : t`Random` },
              ...all.map((id) => ({ value: id, label: placeWord(graph, id) })),
            ]}
            nothingFoundMessage={t`No such goal`}
            onChange={(goal) => {
              if ((goal || null) !== one.goal) onGoal(goal || null);
            }}
          />
          <Button variant="default" px="sm" disabled={!goals?.length} onClick={onPickGoal}>
            <Trans>Choose on the map</Trans>
          </Button>
          {one.goal && (
            <Button variant="default" px="sm" onClick={() => onGoal(null)}>
              <Trans>Random goal</Trans>
            </Button>
          )}
        </Group>
      )}
    </>
  );
}

/** The places that a route leads through, in their order, each of which can be taken out. */
function Passed({
  via,
  graph,
  onVia,
  onPickVia,
}: {
  via: readonly string[];
  graph: Graph;
  onVia: (via: string[]) => void;
  onPickVia: () => void;
}) {
  return (
    <div role="group" aria-label={t`Waypoints`}>
      <Group gap={6} justify="space-between">
        <Text size="sm" fw={500}>
          {via.length === 0 ? t`Waypoints: none` : t`Waypoints`}
        </Text>
        <Button size="compact-xs" variant="default" onClick={onPickVia}>
          <Trans>Add a waypoint</Trans>
        </Button>
      </Group>
      {via.map((id, index) => (
        // The same place may be passed twice.
        <Group key={`${index} ${id}`} gap={6} justify="space-between" wrap="nowrap">
          <Tooltip label={id} position="top-start">
            <Text size="sm">
              {index + 1}. {placeWord(graph, id)}
            </Text>
          </Tooltip>
          <ActionIcon
            size="sm"
            variant="subtle"
            color="red"
            aria-label={t`Remove waypoint ${index + 1}, ${placeWord(graph, id)}`}
            onClick={() => onVia(via.filter((_, other) => other !== index))}
          >
            <IconTrash size={14} />
          </ActionIcon>
        </Group>
      ))}
    </div>
  );
}
