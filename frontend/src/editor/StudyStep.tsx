import { Button, Group, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import type { Edit } from "../api/types";
import { isKey } from "../lists";
import type { Graph } from "../map/graph";
import { Committed } from "./Committed";
import { type PlacePick, useTaking } from "./pick";
import { NodeByName, StationCard } from "./StationForm";
import {
  freeStation,
  lineWords,
  type Station,
  STATION,
  station,
  stationFields,
  type StationKind,
  stationsOf,
  type Study,
  type StudyFields,
} from "./study";

const NEW = localized(() => t`new station`);
const OWN = "own";
/** Seconds of the intervals that are usual. */
const USUAL = ["300", "900", "3600"];

/** What of a run is analysed, and detectors, travel-time sections and cordons. */
export function StudyStep({
  study,
  graph,
  pick,
  onEdit,
  onShow,
}: {
  study: Study;
  graph: Graph;
  pick: PlacePick;
  onEdit: (edit: Edit, label?: string) => void;
  /** Shows nodes on the map. */
  onShow: (nodes: readonly string[]) => void;
}) {
  const [open, setOpen] = useState<string | null>(null);
  const stations = stationsOf(study);
  const change = (fields: StudyFields, label?: string): void =>
    onEdit({ kind: "set_study", ...fields }, label);
  /** Puts another station in the place of that with this id, or takes it out. */
  const put = (id: string, kind: StationKind, next: Station | null, label: string): void =>
    change(
      stationFields(
        kind,
        stations.flatMap((one) => (one.id === id ? (next ?? []) : one)),
      ),
      label,
    );
  return (
    <>
      <Text size="sm">
        <Trans>What of a run is analysed, and where vehicles are counted and timed besides.</Trans>
      </Text>
      <Times study={study} onChange={change} />
      {stations.map((one) => (
        <StationCard
          key={one.id}
          station={one}
          taken={stations.map(({ id }) => id)}
          graph={graph}
          open={open === one.id}
          pick={pick}
          onOpen={setOpen}
          onChange={(next) => put(one.id, one.kind, next, t`Change ${one.id}`)}
          onRemove={() => {
            pick.stop();
            put(one.id, one.kind, null, t`Remove ${one.id}`);
          }}
          onShow={() => onShow(one.lines.flatMap(({ nodes }) => nodes))}
        />
      ))}
      <NewStation
        study={study}
        pick={pick}
        onAdd={(one) => {
          change(stationFields(one.kind, [...stations, one]), t`Add ${one.id}`);
          pick.stop();
          setOpen(one.id);
        }}
      />
    </>
  );
}

function Times({ study, onChange }: { study: Study; onChange: (fields: StudyFields) => void }) {
  const { warm_up, interval } = study;
  const [asked, setAsked] = useState(false);
  const known = interval === null ? "" : String(interval);
  const own = asked || (interval !== null && !USUAL.includes(known));
  return (
    <section className="fold" aria-label={t`What is analysed`}>
      <Committed
        label={t`Warm-up that figures leave out`}
        suffix={" min"}
        min={0}
        max={1e5}
        digits={2}
        value={warm_up / 60}
        onCommit={(minutes) => onChange({ warm_up: Math.round((minutes ?? 0) * 60) })}
      />
      <Select
        label={t`Analysis interval`}
        data={[
          { value: "", label: t`Chosen by the length of the run` },
          { value: "300", label: "5 min" },
          { value: "900", label: "15 min" },
          { value: "3600", label: "60 min" },
          { value: OWN, label: t`Another` },
        ]}
        value={own ? OWN : known}
        allowDeselect={false}
        onChange={(next) => {
          setAsked(next === OWN);
          if (next === null || next === OWN || next === known) return;
          onChange({ interval: next === "" ? null : Number(next) });
        }}
      />
      {own && (
        <Committed
          label={t`Length of an interval`}
          suffix={" min"}
          min={1 / 60}
          max={1440}
          digits={2}
          value={interval === null ? "" : interval / 60}
          onCommit={(minutes) =>
            onChange({ interval: minutes === null ? null : Math.max(1, Math.round(minutes * 60)) })
          }
        />
      )}
    </section>
  );
}

/** A new station begins with one lane of each of its lines; more lanes are added in its form. */
function NewStation({
  study,
  pick,
  onAdd,
}: {
  study: Study;
  pick: PlacePick;
  onAdd: (station: Station) => void;
}) {
  const [kind, setKind] = useState<StationKind>("detectors");
  const [chosen, setChosen] = useState<readonly string[]>([]);
  const words = lineWords(kind);
  const first = words[0] ?? "";
  const word = words[chosen.length] ?? "";
  const stop = (): void => {
    pick.stop();
    setChosen([]);
  };
  const add = (node: string): void => {
    const all = [...chosen, node];
    if (all.length < words.length) {
      setChosen(all);
      return;
    }
    setChosen([]);
    onAdd(
      station(
        kind,
        freeStation(study, kind),
        all.map((one) => [one]),
      ),
    );
  };
  const active = useTaking(pick, NEW(), ({ name }) => add(name));
  return (
    <section className="fold" aria-label={t`New station`}>
      <Select
        label={t`Kind of station`}
        data={Object.entries(STATION()).map(([value, label]) => ({ value, label }))}
        value={kind}
        allowDeselect={false}
        onChange={(next) => {
          if (!isKey(STATION(), next)) return;
          stop();
          setKind(next);
        }}
      />
      {words.length > 1 && (
        <Text size="sm" role="status">
          {chosen[0] === undefined ? t`First its ${first}.` : t`${first}: ${chosen[0]}. Now its ${word}.`}
        </Text>
      )}
      <Group gap={6}>
        <Button aria-pressed={active} onClick={() => (active ? stop() : pick.start(NEW(), "node"))}>
          {active ? t`Stop choosing` : t`Choose it on the map`}
        </Button>
      </Group>
      <NodeByName label={t`or type the node`} onAdd={add} />
    </section>
  );
}
