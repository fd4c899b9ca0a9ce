import { Switch } from "@mantine/core";

import { t } from "@lingui/core/macro";
import type { Edit, FieldsOf } from "../api/types";
import type { Graph } from "../map/graph";
import { Committed } from "./Committed";
import { PartCard } from "./DemandParts";
import { CommittedText, OpenAndShow, PickButton } from "./FormParts";
import type { PlacePick } from "./pick";
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
  const where = placeWord(graph, stop.node);
  return (
    <PartCard
      name={id}
      what={stop.name ? t`Stop ${stop.name}` : t`Stop`}
      note={stop.bay ? t`${where}, in a bay` : where}
      onRemove={() => onRemove(id)}
    >
      <OpenAndShow part={id} open={open} onShow={onShow} onOpen={() => onOpen(open ? null : key)} />
      {open && (
        <>
          <CommittedText
            label={t`Name for people`}
            value={stop.name}
            maxLength={200}
            onCommit={(name) => change({ name })}
          />
          <Committed
            label={t`Length`}
            suffix={" m"}
            min={5}
            max={200}
            digits={1}
            value={stop.length}
            onCommit={(length) => {
              if (length !== null) change({ length });
            }}
          />
          <Switch
            label={t`In a bay beside the lane`}
            checked={stop.bay}
            onChange={(event) => change({ bay: event.currentTarget.checked })}
          />
          <PickButton pick={pick} pickKey={key} by="node" onTake={({ name }) => change({ node: name })}>
            {t`Move it on the map`}
          </PickButton>
        </>
      )}
    </PartCard>
  );
}
