import { Button, Collapse, Group, Stack, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type ReactNode, useDeferredValue, useState } from "react";

import type { Chosen } from "../api/models";
import { type Actor, type Assets, CATEGORIES, type Edit, type Flow } from "../api/types";
import type { Graph, Place } from "../map/graph";
import { CategoryGlyph, IconFlow, IconTrash } from "../ui/icons";
import { CATEGORY_WORD, flowWord } from "../ui/words";
import { ActorForm, ManyForm } from "./ActorForm";
import { ArrangeForm } from "./ArrangeForm";
import type { Profiles } from "./DayProfiles";
import { FillForm } from "./FillForm";
import { FlowForm } from "./FlowForm";
import { copyTool } from "./handlers/copy";
import { flowTool } from "./handlers/flow";
import type { Tool } from "./handlers/handler";
import { goalTool } from "./handlers/goal";
import { moveTool } from "./handlers/move";
import { placeTool } from "./handlers/place";
import { waypointTool } from "./handlers/waypoint";
import { isFlow, type Starts } from "./placing";
import { StartAndGoal } from "./StartAndGoal";

interface Props {
  assets: Assets | null;
  graph: Graph;
  starts: Starts;
  selected: readonly (Actor | Flow)[];
  tool: Tool | null;
  goals: readonly Place[] | null;
  actors: number;
  profiles: Profiles;
  driverSets: readonly string[];
  filling: boolean;
  onTool: (tool: Tool | null) => void;
  /** Uses the tool without the map. */
  onPlaceSomewhere: () => void;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  onStart: (one: Actor | Flow, spawn: string) => void;
  onGoal: (one: Actor | Flow, goal: string | null) => void;
  onRemove: () => void;
  onSelect: (ids: string[]) => void;
  onShowGoals: () => void;
  onFill: (share: number, seed: number, filler: Chosen | null) => void;
}

/** Choose a kind, place road users on the map, then set where they go and how. */
export function ActorStep(props: Props) {
  const { assets, graph, starts, selected, tool, goals, onTool, onEdit } = props;
  const [filling, setFilling] = useState(false);
  const one = selected.length === 1 ? selected[0] : null;
  // A form takes longer to make than all else: it follows what map and table show already.
  const before = useDeferredValue(one);
  const formed = before?.id === one?.id ? one : before;
  const itinerary = one && (
    <StartAndGoal
      one={one}
      graph={graph}
      starts={starts}
      goals={goals}
      onPickGoal={() => {
        props.onShowGoals();
        onTool(goalTool(one.id));
      }}
      onStart={(spawn) => props.onStart(one, spawn)}
      onGoal={(goal) => props.onGoal(one, goal)}
      onPickVia={() => onTool(waypointTool(one.id))}
      onVia={(via) => onEdit({ kind: "change_actor", actor: one.id, via })}
    />
  );
  const actors = selected.filter((each): each is Actor => !isFlow(each));
  return (
    <>
      <div className="palette" role="group" aria-label={t`Kind of road user to place`}>
        {CATEGORIES.map((category) => (
          <ToolButton key={category} of={placeTool(category)} tool={tool} onTool={onTool}>
            <CategoryGlyph category={category} size={32} />
            {CATEGORY_WORD()[category]}
          </ToolButton>
        ))}
      </div>
      <div className="palette flows" role="group" aria-label={t`Flow to place`}>
        {[false, true].map((walks) => (
          <ToolButton key={String(walks)} of={flowTool(walks)} tool={tool} onTool={onTool}>
            <IconFlow size={22} />
            {flowWord(walks)}
          </ToolButton>
        ))}
      </div>
      <ToolHint tool={tool} onPlaceSomewhere={props.onPlaceSomewhere} />
      {selected.length > 0 && (
        <Stack
          gap="sm"
          component="section"
          aria-label={one ? t`Settings of ${one.id}` : t`Settings of ${selected.length} road users`}
        >
          <Group gap={8} wrap="nowrap">
            {one &&
              (isFlow(one) ? <IconFlow size={24} /> : <CategoryGlyph category={one.category} size={26} />)}
            <Text fw={700}>{one ? one.id : t`${selected.length} selected`}</Text>
          </Group>
          <Group gap={6}>
            {actors.length > 0 && (
              <Button
                size="compact-sm"
                variant="default"
                onClick={() => onTool(copyTool(actors.map((each) => each.id)))}
              >
                <Trans>Copy</Trans>
              </Button>
            )}
            <Button
              size="compact-sm"
              variant="default"
              onClick={() => onTool(moveTool(selected.map((each) => each.id)))}
            >
              <Trans>Move</Trans>
            </Button>
            <Button
              size="compact-sm"
              color="red"
              variant="light"
              leftSection={<IconTrash size={15} />}
              onClick={props.onRemove}
            >
              <Trans>Remove</Trans>
            </Button>
            <Button size="compact-sm" variant="subtle" onClick={() => props.onSelect([])}>
              <Trans>Clear selection</Trans>
            </Button>
          </Group>
          {one &&
            formed &&
            (isFlow(formed) ? (
              <>
                {itinerary}
                <FlowForm key={formed.id} flow={formed} profiles={props.profiles} onEdit={onEdit} />
              </>
            ) : (
              <ActorForm
                key={formed.id}
                actor={formed}
                driverSets={props.driverSets}
                assets={assets}
                between={itinerary}
                onEdit={onEdit}
              />
            ))}
          {!one && actors.length > 1 && (
            <ArrangeForm
              key={actors.map(({ id }) => id).join(" ")}
              actors={actors}
              graph={graph}
              starts={starts}
              onEdit={onEdit}
            />
          )}
          {!one && actors.length > 0 && (
            <ManyForm
              actors={actors}
              driverSets={props.driverSets}
              onChange={(fields, what) =>
                onEdit(
                  actors.map((each) => ({ kind: "change_actor", actor: each.id, ...fields })),
                  t`${what} of ${actors.length} road users`,
                )
              }
            />
          )}
        </Stack>
      )}
      <Button
        variant="subtle"
        size="compact-sm"
        justify="flex-start"
        aria-expanded={filling}
        onClick={() => setFilling(!filling)}
      >
        {filling ? t`Hide` : t`Generate traffic`}
      </Button>
      <Collapse in={filling}>
        {filling && <FillForm actors={props.actors} busy={props.filling} onFill={props.onFill} />}
      </Collapse>
    </>
  );
}

/** Takes a tool into the hand, or puts it back. */
function ToolButton({
  of,
  tool,
  onTool,
  children,
}: {
  of: Tool;
  tool: Tool | null;
  onTool: (tool: Tool | null) => void;
  children: ReactNode;
}) {
  const on = tool?.key === of.key;
  return (
    <button type="button" aria-pressed={on} onClick={() => onTool(on ? null : of)}>
      {children}
    </button>
  );
}

function ToolHint({ tool, onPlaceSomewhere }: { tool: Tool | null; onPlaceSomewhere: () => void }) {
  return (
    <>
      <Text size="sm" c="dimmed" aria-live="polite">
        {tool ? tool.help : t`Choose a kind, then click on the map to place it.`}
      </Text>
      {tool && (
        <Button size="compact-sm" variant="default" onClick={onPlaceSomewhere}>
          {tool.elsewhere}
        </Button>
      )}
    </>
  );
}
