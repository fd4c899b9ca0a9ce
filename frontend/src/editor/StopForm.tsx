import { Button, Group, Switch, TextInput } from "@mantine/core";

import type { Edit, FieldsOf } from "../api/types";
import type { Graph } from "../map/graph";
import { Committed } from "./Committed";
import { PartCard } from "./DemandParts";
import { type PlacePick, useTaking } from "./pick";
import { placeWord } from "./placeWords";
import type { Stop } from "./transit";

export interface CardProps {
  graph: Graph;
  open: boolean;
  pick: PlacePick;
  onOpen: (part: string | null) => void;
  onEdit: (edit: Edit) => void;
  onRemove: (part: string) => void;
  onShow: () => void;
}

export function StopCard({
  stop,
  graph,
  open,
  pick,
  onOpen,
  onEdit,
  onRemove,
  onShow,
}: CardProps & { stop: Stop }) {
  const { id } = stop;
  const key = `stop ${id}`;
  const change = (fields: FieldsOf<"set_stop", "stop">): void =>
    onEdit({ kind: "set_stop", stop: id, ...fields });
  const active = useTaking(pick, key, ({ name }) => {
    change({ node: name });
    pick.stop();
  });
  const rename = (name: string): void => {
    if (name.trim() !== stop.name) change({ name: name.trim() });
  };
  const where = placeWord(graph, stop.node);
  return (
    <PartCard
      name={id}
      what={stop.name ? `Stop ${stop.name}` : "Stop"}
      note={stop.bay ? `${where}, in a bay` : where}
      onRemove={() => onRemove(id)}
    >
      <OpenAndShow part={id} open={open} onShow={onShow} onOpen={() => onOpen(open ? null : key)} />
      {open && (
        <>
          <TextInput
            label="Name for people"
            key={stop.name}
            defaultValue={stop.name}
            maxLength={200}
            onBlur={(event) => rename(event.currentTarget.value)}
            onKeyDown={(event) => {
              if (event.key === "Enter") rename(event.currentTarget.value);
            }}
          />
          <Committed
            label="Length"
            suffix=" m"
            min={5}
            max={200}
            digits={1}
            value={stop.length}
            onCommit={(length) => {
              if (length !== null) change({ length });
            }}
          />
          <Switch
            label="In a bay beside the lane"
            checked={stop.bay}
            onChange={(event) => change({ bay: event.currentTarget.checked })}
          />
          <Button
            size="compact-sm"
            variant="default"
            aria-pressed={active}
            onClick={() => (active ? pick.stop() : pick.start(key, "node"))}
          >
            {active ? "Stop choosing" : "Move it on the map"}
          </Button>
        </>
      )}
    </PartCard>
  );
}

/** Opens the form of a part, and shows on the map where it is. */
export function OpenAndShow({
  part,
  open,
  onOpen,
  onShow,
}: {
  part: string;
  open: boolean;
  onOpen: () => void;
  onShow: () => void;
}) {
  return (
    <Group gap={6}>
      <Button
        size="compact-sm"
        variant="default"
        aria-expanded={open}
        aria-label={`${open ? "Close" : "Change"} ${part}`}
        onClick={onOpen}
      >
        {open ? "Close" : "Change"}
      </Button>
      <Button size="compact-sm" variant="default" aria-label={`Show where ${part} is`} onClick={onShow}>
        Show where
      </Button>
    </Group>
  );
}
