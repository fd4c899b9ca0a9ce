import { Group, Select, Text } from "@mantine/core";

import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type FieldsOf, CATEGORIES } from "../api/types";
import { isKey, nth } from "../lists";
import { clock } from "../language/moments";
import { inSentence, CATEGORY_WORD } from "../ui/words";
import { Committed } from "./Committed";
import { PartCard, WindowFields } from "./DemandParts";
import { ListButtons, OpenAndShow, PickButton } from "./FormParts";
import { placeWord } from "./placeWords";
import type { CardProps } from "./StopForm";
import { type Line, servedOf, type Stop, stopWord, timetableWord } from "./transit";

/** A line: how often it runs, where it begins and ends, and its stops. */
export function LineCard({
  line,
  stops,
  graph,
  open,
  pick,
  onOpen,
  onEdit,
  onRemove,
  onShow,
}: CardProps & { line: Line; stops: readonly Stop[] }) {
  const { id } = line;
  const key = `line ${id}`;
  const change = (fields: FieldsOf<"set_line", "line">): void =>
    onEdit({ kind: "set_line", line: id, ...fields });
  const word = inSentence(CATEGORY_WORD()[line.category]);
  return (
    <PartCard
      name={id}
      what={t`Line`}
      note={`${word}, ${timetableWord(line)}, ${plural(line.stops.length, { one: "# stop", other: "# stops" })}`}
      onRemove={() => onRemove(id)}
    >
      <OpenAndShow part={id} open={open} onShow={onShow} onOpen={() => onOpen(open ? null : key)} />
      {open && (
        <>
          <TimetableFields line={line} onChange={change} />
          <Ends line={line} graph={graph} pick={pick} onChange={change} />
          <Served line={line} stops={stops} onChange={change} />
        </>
      )}
    </PartCard>
  );
}

type Change = (fields: FieldsOf<"set_line", "line">) => void;

function TimetableFields({ line, onChange }: { line: Line; onChange: Change }) {
  return (
    <>
      {line.headway === null ? (
        <Text size="sm">
          <Trans>Departs at {line.departures.map((time) => clock(time)).join(", ")} of the run</Trans>
        </Text>
      ) : (
        <>
          <Committed
            label={t`A trip every`}
            suffix={" min"}
            min={0.2}
            max={1440}
            digits={1}
            value={line.headway / 60}
            onCommit={(value) => {
              if (value !== null) onChange({ headway: value * 60 });
            }}
          />
          <WindowFields begin={line.begin} end={line.end} onChange={onChange} />
        </>
      )}
      <Group grow align="flex-start">
        {typeof line.dwell === "number" ? (
          <Committed
            label={t`Dwell time`}
            suffix={" s"}
            min={0}
            max={3600}
            digits={0}
            value={line.dwell}
            onCommit={(value) => onChange({ dwell: { kind: "constant", value: value ?? 20 } })}
          />
        ) : (
          <Text size="sm">
            <Trans>Dwell time by a distribution: {String(line.dwell.kind)}</Trans>
          </Text>
        )}
        <Select
          label={t`Vehicles`}
          allowDeselect={false}
          data={CATEGORIES.filter((one) => one !== "pedestrian").map((value) => ({
            value,
            label: CATEGORY_WORD()[value],
          }))}
          value={line.category}
          onChange={(category) => {
            if (isKey(CATEGORY_WORD(), category)) onChange({ category, model: null });
          }}
        />
      </Group>
    </>
  );
}

function Ends({ line, graph, pick, onChange }: Omit<EndProps, "end">) {
  return (
    <>
      <End end="start" line={line} graph={graph} pick={pick} onChange={onChange} />
      <End end="goal" line={line} graph={graph} pick={pick} onChange={onChange} />
    </>
  );
}

interface EndProps extends Pick<CardProps, "graph" | "pick"> {
  end: "start" | "goal";
  line: Line;
  onChange: Change;
}

function End({ end, line, graph, pick, onChange }: EndProps) {
  const node = line[end];
  const word = end === "start" ? t`Begins` : t`Ends`;
  return (
    <Group gap={6} justify="space-between" wrap="nowrap">
      <Text size="sm">
        {word}: {node === null ? t`at an end of the region` : placeWord(graph, node)}
      </Text>
      <PickButton
        pick={pick}
        pickKey={`${end} of ${line.id}`}
        by="node"
        style={{ flexShrink: 0 }}
        name={t`Choose where it ${inSentence(word)}`}
        onTake={({ name }) => onChange({ [end]: name })}
      >
        {t`Choose`}
      </PickButton>
    </Group>
  );
}

/** Stops in their order, each with its scheduled departure; more are added at the end. */
function Served({ line, stops, onChange }: { line: Line; stops: readonly Stop[]; onChange: Change }) {
  const onServed = (served: Line["stops"]): void => onChange({ stops: servedOf(served) });
  const known = new Map(stops.map((stop) => [stop.id, stop]));
  const put = (n: number, fields: Partial<Line["stops"][number]>): void =>
    onServed(line.stops.map((one, k) => (k === n ? { ...one, ...fields } : one)));
  const swap = (n: number): void => {
    const next = [...line.stops];
    [next[n - 1], next[n]] = [nth(next, n), nth(next, n - 1)];
    // The times belong to the places in the order, not to the stops.
    onServed(next.map((one, k) => ({ ...one, after: nth(line.stops, k).after })));
  };
  return (
    <section aria-label={t`Stops of line ${line.id}`}>
      {line.stops.map(({ stop, after }, n) => {
        const name = known.get(stop);
        return (
          <Group key={`${n} ${stop}`} gap={6} align="flex-end" wrap="nowrap" mb={6}>
            <div style={{ flex: 1 }}>
              <Committed
                label={t`${n + 1}. ${name ? stopWord(name) : stop}, departs after`}
                suffix={" s"}
                min={0}
                max={1e6}
                digits={0}
                placeholder={t`no timetable`}
                value={after ?? ""}
                onCommit={(value) => put(n, { after: value })}
              />
            </div>
            <ListButtons
              earlier={t`Serve ${stop} earlier`}
              removal={t`Leave out ${stop}`}
              first={n === 0}
              only={line.stops.length === 1}
              onEarlier={() => swap(n)}
              onRemove={() => onServed(line.stops.filter((_, k) => k !== n))}
            />
          </Group>
        );
      })}
      <Select
        label={t`Serve one more stop`}
        placeholder={t`Choose a stop`}
        value={null}
        searchable
        data={stops.map((stop) => ({ value: stop.id, label: stopWord(stop) }))}
        onChange={(stop) => {
          if (stop) onServed([...line.stops, { stop, after: null, dwell: null }]);
        }}
      />
    </section>
  );
}
