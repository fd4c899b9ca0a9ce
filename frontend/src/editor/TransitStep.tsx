import { Button, MultiSelect, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import type { Edit, ScenarioDocument } from "../api/types";
import type { Graph } from "../map/graph";
import { LineCard } from "./LineForm";
import { type PlacePick, useTaking } from "./pick";
import { StopCard } from "./StopForm";
import { freePartId, type Stop, stopWord } from "./transit";

const NEW_STOP = localized(() => t`new stop`);
const NEW_LINE = localized(() => t`new line`);
/** Seconds between the trips of a new line. */
const HEADWAY = 600;

type Transit = ScenarioDocument["transit"];

/** Stops, and lines that serve them. */
export function TransitStep({
  transit,
  graph,
  pick,
  onEdit,
  onShow,
}: {
  transit: Transit;
  graph: Graph;
  pick: PlacePick;
  onEdit: (edit: Edit | readonly Edit[], label?: string) => void;
  /** Shows nodes on the map. */
  onShow: (nodes: readonly string[]) => void;
}) {
  const { stops, lines } = transit;
  const [open, setOpen] = useState<string | null>(null);
  const remove = (part: string): void => {
    pick.stop();
    onEdit({ kind: "remove_transit", part });
  };
  const shared = { pick, onOpen: setOpen, onEdit, onRemove: remove };
  return (
    <>
      <Text size="sm">
        <Trans>Lines whose vehicles stop at stops: by a timetable, or every so many minutes.</Trans>
      </Text>
      {lines.map((line) => (
        <LineCard
          key={`line ${line.id}`}
          line={line}
          stops={stops}
          graph={graph}
          open={open === `line ${line.id}`}
          onShow={() => onShow(nodesOf(line, stops))}
          {...shared}
        />
      ))}
      {stops.length > 0 && <NewLine transit={transit} pick={pick} onEdit={onEdit} onOpen={setOpen} />}
      {stops.map((stop) => (
        <StopCard
          key={`stop ${stop.id}`}
          stop={stop}
          graph={graph}
          open={open === `stop ${stop.id}`}
          onShow={() => onShow([stop.node])}
          {...shared}
        />
      ))}
      <NewStop transit={transit} pick={pick} onEdit={onEdit} />
    </>
  );
}

const nodesOf = (line: Transit["lines"][number], stops: readonly Stop[]): string[] => [
  line.start,
  ...stops.filter(({ id }) => line.stops.some(({ stop }) => stop === id)).map(({ node }) => node),
  ...(line.goal === null ? [] : [line.goal]),
];

/** Each click on a lane adds a stop, until it is stopped. */
function NewStop({
  transit,
  pick,
  onEdit,
}: {
  transit: Transit;
  pick: PlacePick;
  onEdit: (edit: Edit, label?: string) => void;
}) {
  const active = useTaking(pick, NEW_STOP(), ({ name }) => {
    const stop = freePartId(transit, "stop");
    onEdit({ kind: "set_stop", stop, node: name }, t`Add ${stop}`);
  });
  return (
    <Button
      variant="default"
      className="wrapping"
      aria-pressed={active}
      onClick={() => (active ? pick.stop() : pick.start(NEW_STOP(), "node"))}
    >
      {active ? t`Stop adding stops` : t`Add stops on the map`}
    </Button>
  );
}

/** A line needs its stops in their order, and where its vehicles set off. */
function NewLine({
  transit,
  pick,
  onEdit,
  onOpen,
}: {
  transit: Transit;
  pick: PlacePick;
  onEdit: (edit: Edit, label?: string) => void;
  onOpen: (part: string) => void;
}) {
  const [adding, setAdding] = useState(false);
  const [served, setServed] = useState<string[]>([]);
  const active = useTaking(pick, NEW_LINE(), ({ name }) => {
    const line = freePartId(transit, "line");
    const stops = served.map((stop) => ({ stop }));
    onEdit({ kind: "set_line", line, start: name, stops, headway: HEADWAY }, t`Add ${line}`);
    pick.stop();
    setServed([]);
    setAdding(false);
    onOpen(`line ${line}`);
  });
  if (!adding)
    return (
      <Button variant="default" aria-expanded={false} onClick={() => setAdding(true)}>
        <Trans>Add a line</Trans>
      </Button>
    );
  return (
    <section className="fold" aria-label={t`New line`}>
      <MultiSelect
        label={t`Its stops, in their order`}
        data={transit.stops.map((stop) => ({ value: stop.id, label: stopWord(stop) }))}
        value={served}
        onChange={setServed}
        searchable
      />
      <Button
        className="wrapping"
        disabled={served.length === 0}
        aria-pressed={active}
        onClick={() => (active ? pick.stop() : pick.start(NEW_LINE(), "node"))}
      >
        {active ? t`Stop choosing` : t`Choose on the map where it begins`}
      </Button>
      <Button
        variant="subtle"
        size="compact-sm"
        onClick={() => {
          pick.stop();
          setAdding(false);
        }}
      >
        <Trans>Cancel</Trans>
      </Button>
    </section>
  );
}
