import { Button, Checkbox, Group, NumberInput, Select, Stack, Text, Tooltip } from "@mantine/core";

import type { Actor, Assets, Category, Edit, Style } from "../api/types";
import { CATEGORIES } from "../api/types";
import { CATEGORY_COLOR } from "../map/colors";
import { CategoryGlyph, IconTrash } from "../ui/icons";
import { CATEGORY_WORD, modelWord, STYLE_WORD } from "../ui/words";
import { bodyOf } from "./scene";

interface Props {
  assets: Assets | null;
  actors: readonly Actor[];
  selected: readonly Actor[];
  armed: Category | null;
  goals: number | null;
  onArm: (category: Category | null) => void;
  onEdit: (edit: Edit) => void;
  onSelect: (ids: string[]) => void;
  onShowGoals: () => void;
}

/** Choose who, place them on the map, then say where they go and how. */
export function ActorStep({ assets, selected, armed, goals, onArm, onEdit, onSelect, onShowGoals }: Props) {
  const one = selected.length === 1 ? selected[0] : null;
  return (
    <>
      <div className="palette" role="group" aria-label="Kind of road user to place">
        {CATEGORIES.map((category) => (
          <button type="button" key={category} aria-pressed={armed === category}
            onClick={() => onArm(armed === category ? null : category)}>
            <CategoryGlyph category={category} size={32} />
            {CATEGORY_WORD[category]}
          </button>
        ))}
      </div>
      <Text size="sm" c="dimmed" aria-live="polite">
        {armed
          ? `Now click where the ${CATEGORY_WORD[armed].toLowerCase()} starts: a ${armed === "pedestrian" ? "yellow" : "blue"} point on the map. Escape stops placing.`
          : "Choose a kind, then click on the map to place it."}
      </Text>
      {one && <ActorForm key={one.id} actor={one} assets={assets} goals={goals} onEdit={onEdit} onShowGoals={onShowGoals} />}
      {selected.length > 1 && (
        <Group justify="space-between">
          <Text size="sm" fw={600}>{selected.length} selected</Text>
          <Button size="compact-sm" color="red" variant="light" leftSection={<IconTrash size={15} />}
            onClick={() => onEdit({ kind: "remove_actors", actors: selected.map((a) => a.id) })}>Remove them</Button>
          <Button size="compact-sm" variant="subtle" onClick={() => onSelect([])}>Select none</Button>
        </Group>
      )}
    </>
  );
}

function ActorForm({ actor, assets, goals, onEdit, onShowGoals }: {
  actor: Actor; assets: Assets | null; goals: number | null; onEdit: (edit: Edit) => void; onShowGoals: () => void;
}) {
  const change = (fields: Partial<Actor>): void => onEdit({ kind: "change_actor", actor: actor.id, ...fields });
  const walks = actor.category === "pedestrian";
  const models = (assets?.blueprints ?? []).filter((one) => one.category === actor.category)
    .map((one) => ({ value: one.id, label: modelWord(one.id) }));
  const [length, width] = bodyOf(actor, assets);
  return (
    <Stack gap="sm" component="section" aria-label={`Settings of ${actor.id}`}>
      <Group justify="space-between" wrap="nowrap">
        <Group gap={8} wrap="nowrap"><CategoryGlyph category={actor.category} size={26} /><Text fw={700}>{actor.id}</Text></Group>
        <Tooltip label="Remove (Delete key)">
          <Button size="compact-sm" color="red" variant="light" leftSection={<IconTrash size={15} />}
            onClick={() => onEdit({ kind: "remove_actors", actors: [actor.id] })}>Remove</Button>
        </Tooltip>
      </Group>
      <Silhouette actor={actor} length={length} width={width} />
      <Group justify="space-between" gap={6}>
        <Text size="sm">{actor.goal
          ? "Goal: chosen"
          : goals === null ? "Goal: by chance"
          : goals === 0 ? "No goal can be reached from here; move the start or grow the region."
          : `Goal: by chance among ${goals}; click a light-blue point to choose`}</Text>
        {goals !== null && goals > 0 && <Button size="compact-xs" variant="default" onClick={onShowGoals}>Show goals</Button>}
        {actor.goal && <Button size="compact-xs" variant="subtle" onClick={() => onEdit({ kind: "set_goal", actor: actor.id, goal: null })}>By chance</Button>}
      </Group>
      <Select label="Model" searchable clearable placeholder="Any" data={models} value={actor.model} nothingFoundMessage="No such model"
        onChange={(model) => change({ model })} />
      <Group grow align="flex-start">
        <Committed label={walks ? "Walking speed" : "Desired speed"} suffix=" km/h" min={1} max={walks ? 15 : 250} digits={1}
          placeholder={walks ? "usual" : "the limit"} value={actor.speed === null ? "" : actor.speed * 3.6}
          onCommit={(value) => change({ speed: value === null ? null : value / 3.6 })} />
        <Committed label="Starts after" suffix=" s" min={0} max={86_400} digits={1} value={actor.depart}
          onCommit={(value) => change({ depart: value ?? 0 })} />
      </Group>
      {!walks && (
        <Group grow align="flex-start">
          <Committed label="Left of lane centre" suffix=" m" min={-3} max={3} step={0.1} digits={2} value={actor.lateral_offset}
            onCommit={(value) => change({ lateral_offset: value ?? 0 })} />
          <Select label="Driving style" allowDeselect={false} value={actor.style}
            data={Object.entries(STYLE_WORD).map(([value, label]) => ({ value, label }))}
            onChange={(style) => change({ style: (style ?? "normal") as Style })} />
        </Group>
      )}
      {!walks && <Checkbox label="This is my vehicle under test (ego)" checked={actor.ego}
        onChange={(event) => onEdit({ kind: "set_ego", actor: event.currentTarget.checked ? actor.id : null })} />}
      {walks && <Checkbox label="Crosses the road anywhere" checked={actor.crosses_anywhere}
        onChange={(event) => change({ crosses_anywhere: event.currentTarget.checked })} />}
      {walks && <Checkbox label="Ignores red lights" checked={actor.ignores_red}
        onChange={(event) => change({ ignores_red: event.currentTarget.checked })} />}
    </Stack>
  );
}

/** A number that is sent when it is finished, not with every key. */
function Committed({ label, value, digits, onCommit, ...rest }: {
  label: string; value: number | ""; digits: number; suffix: string; min: number; max: number;
  step?: number; placeholder?: string; onCommit: (value: number | null) => void;
}) {
  const shown = value === "" ? "" : Number(value.toFixed(digits));
  const commit = (text: string): void => {
    const found = Number.parseFloat(text);
    const next = Number.isNaN(found) ? null : Math.min(Math.max(found, rest.min), rest.max);
    if (next !== (shown === "" ? null : shown)) onCommit(next);
  };
  return (
    <NumberInput key={String(shown)} label={label} defaultValue={shown} decimalScale={digits} {...rest}
      onBlur={(event) => commit(event.currentTarget.value)}
      onKeyDown={(event) => { if (event.key === "Enter") commit(event.currentTarget.value); }} />
  );
}

/** The body from above, to scale with a lane of 3.5 m. */
function Silhouette({ actor, length, width }: { actor: Actor; length: number; width: number }) {
  const y = 1.75 - width / 2 - actor.lateral_offset;
  return (
    <figure style={{ margin: 0 }}>
      <svg className="silhouette" viewBox="-1 -0.300 22 4.100" role="img" aria-label={`${length.toFixed(1)} m long, ${width.toFixed(1)} m wide, on a lane of 3.5 m`}>
        <rect x={-1} y={0} width={22} height={3.5} fill="#969ea8" />
        <path d="M-1 0h22M-1 3.500h22" stroke="#fff" strokeWidth={0.15} strokeDasharray="1.500 1" />
        <path d={`M8 ${y}h${Math.max(length - width * 0.35, 0.1)}l${width * 0.35} ${width * 0.28}v${width * 0.44}l${-width * 0.35} ${width * 0.28}h${-Math.max(length - width * 0.35, 0.1)}z`}
          fill={CATEGORY_COLOR[actor.category]} stroke="#fff" strokeWidth={0.08} />
      </svg>
      <figcaption style={{ fontSize: 12 }}>{length.toFixed(1)} m long, {width.toFixed(1)} m wide</figcaption>
    </figure>
  );
}
