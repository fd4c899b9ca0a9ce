import { ActionIcon, Button, Group, Text, TextInput } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { inSentence } from "../ui/words";
import type { Graph } from "../map/graph";
import { IconTrash } from "../ui/icons";
import { PartCard } from "./DemandParts";
import { type PlacePick, useTaking } from "./pick";
import { placeWord } from "./placeWords";
import { OpenAndShow } from "./FormParts";
import { type Station, STATION, type StationLine, toggled } from "./study";

/** One detector, travel-time section or cordon: its name, and the lanes of its lines. */
export function StationCard({
  station,
  taken,
  graph,
  open,
  pick,
  onOpen,
  onChange,
  onRemove,
  onShow,
}: {
  station: Station;
  /** Ids of all stations. */
  taken: readonly string[];
  graph: Graph;
  open: boolean;
  pick: PlacePick;
  onOpen: (id: string | null) => void;
  onChange: (station: Station) => void;
  onRemove: () => void;
  onShow: () => void;
}) {
  const { id, kind, lines } = station;
  const [refused, setRefused] = useState<string | null>(null);
  const rename = (text: string): void => {
    const name = text.trim();
    const problem = name !== id && taken.includes(name) ? t`${name} is taken` : null;
    setRefused(name === "" ? t`A station needs a name` : problem);
    if (name === "" || problem || name === id) return;
    pick.stop();
    onChange({ ...station, id: name });
    onOpen(name);
  };
  const note = lines.map(
    ({ word, nodes }) => `${inSentence(word)} ${plural(nodes.length, { one: "# lane", other: "# lanes" })}`,
  );
  return (
    <PartCard
      name={id}
      what={STATION()[kind]}
      note={
        kind === "detectors"
          ? plural(lines[0]?.nodes.length ?? 0, { one: "# lane", other: "# lanes" })
          : note.join(", ")
      }
      onRemove={onRemove}
    >
      <OpenAndShow part={id} open={open} onShow={onShow} onOpen={() => onOpen(open ? null : id)} />
      {open && (
        <>
          <TextInput
            label={t`Name`}
            key={id}
            defaultValue={id}
            maxLength={64}
            error={refused}
            onBlur={(event) => rename(event.currentTarget.value)}
            onKeyDown={(event) => {
              if (event.key === "Enter") rename(event.currentTarget.value);
            }}
          />
          {lines.map((line) => (
            <LineLanes
              key={line.field}
              of={id}
              line={line}
              graph={graph}
              pick={pick}
              onToggle={(node) => onChange(toggled(station, line.field, node))}
            />
          ))}
        </>
      )}
    </PartCard>
  );
}

/** The lanes that a line crosses; a click on the map adds one, or takes it out. */
function LineLanes({
  of,
  line,
  graph,
  pick,
  onToggle,
}: {
  of: string;
  line: StationLine;
  graph: Graph;
  pick: PlacePick;
  onToggle: (node: string) => void;
}) {
  const { field, word, nodes } = line;
  const key = `station ${of} ${field}`;
  const toggle = (node: string): void => {
    // A line crosses one lane at least.
    if (nodes.length > 1 || !nodes.includes(node)) onToggle(node);
  };
  const active = useTaking(pick, key, ({ name }) => toggle(name));
  return (
    <section aria-label={t`${word} of ${of}`}>
      <Text size="sm" fw={500}>
        {word}
      </Text>
      {nodes.map((node) => (
        <Group key={node} justify="space-between" wrap="nowrap" gap={6}>
          <Text size="sm" style={{ overflowWrap: "anywhere" }}>
            {placeWord(graph, node)}
          </Text>
          <ActionIcon
            variant="subtle"
            color="gray"
            disabled={nodes.length === 1}
            aria-label={t`Take ${placeWord(graph, node)} out of ${inSentence(word)} of ${of}`}
            onClick={() => toggle(node)}
          >
            <IconTrash />
          </ActionIcon>
        </Group>
      ))}
      <Button
        size="compact-sm"
        variant="default"
        aria-pressed={active}
        onClick={() => (active ? pick.stop() : pick.start(key, "node"))}
      >
        {active ? t`Stop choosing` : t`${word}: choose lanes on the map`}
      </Button>
      <NodeByName label={t`${word}: or type a node`} onAdd={toggle} />
    </section>
  );
}

/** A node of the lane graph by its name, for those who know it or do not use the map. */
export function NodeByName({ label, onAdd }: { label: string; onAdd: (node: string) => void }) {
  const [typed, setTyped] = useState("");
  const add = (): void => {
    if (!typed.trim()) return;
    onAdd(typed.trim());
    setTyped("");
  };
  return (
    <Group gap={6} align="flex-end" wrap="nowrap">
      <TextInput
        style={{ flex: 1 }}
        label={label}
        placeholder="1.0.-1.20"
        value={typed}
        onChange={(event) => setTyped(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === "Enter") add();
        }}
      />
      <Button variant="default" disabled={!typed.trim()} aria-label={t`Add ${label}`} onClick={add}>
        <Trans>Add</Trans>
      </Button>
    </Group>
  );
}
