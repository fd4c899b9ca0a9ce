import { Alert, Anchor, Button, FileButton, Group, List, Select, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useRef, useState } from "react";

import { localized } from "../language/localized";
import { ApiError } from "../api/client";
import { type Demand, demand, type TableKind } from "../api/demand";
import { isKey } from "../lists";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { exampleTable } from "./demand";
import type { EditorStore } from "./store";
import { sentence } from "../ui/words";
import { served } from "../language/served";

const KINDS = localized((): Record<TableKind, { label: string; stem: string | null; text: string }> => ({
  od: {
    label: t`Trips between zones`,
    stem: "trips",
    text: t`How many trips go from one segment or zone to another. Columns “begin” and “end” may say when.`,
  },
  inputs: {
    label: t`Vehicle inputs`,
    stem: "input",
    text: t`How many vehicles drive into the region on a segment in each slice of time; a column “direction” where both directions lead in.`,
  },
  counts: {
    label: t`Counts`,
    stem: "counts",
    text: t`How many vehicles passed a count station, to be reproduced by traffic. A count station is a segment, or consecutive segments: r1>j2>r3.`,
  },
  profile: {
    label: t`A day profile`,
    stem: "my-day",
    text: t`The share of the traffic in each equal slice of a day, from midnight.`,
  },
  office: {
    label: t`File of another program`,
    stem: null,
    text: t`Matrices of VISUM and SUMO, edgeData, turn ratios, detectors and their output, tables with any titles, also of Excel: it is found out what the file is.`,
  },
  zones: { label: t`Zones`, stem: null, text: t`Names for groups of segments, for use in tables of trips.` },
}));

interface Refusal {
  file: string;
  problems: string[];
}

/** Imports a table into the scenario, all of it or nothing. */
export function TableForm({
  store,
  demand: known,
  roads,
}: {
  store: EditorStore;
  demand: Demand;
  /** Roads of the region, for the example. */
  roads: readonly string[];
}) {
  const { name, take } = store();
  const [kind, setKind] = useState<TableKind>("od");
  const [part, setPart] = useState("trips");
  const [busy, setBusy] = useState(false);
  const [refusal, setRefusal] = useState<Refusal | null>(null);
  const reset = useRef<() => void>(null);
  const alert = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (refusal) alert.current?.scrollIntoView({ block: "nearest" });
  }, [refusal]);
  const chosen = KINDS()[kind];
  const example = exampleTable(kind, known, roads);
  const choose = (next: string | null): void => {
    if (!isKey(KINDS(), next)) return;
    setKind(next);
    setPart(KINDS()[next].stem ?? "");
    setRefusal(null);
  };
  const send = (file: File | null): void => {
    reset.current?.(); // the same file can be chosen again once it is corrected
    if (!file) return;
    setBusy(true);
    setRefusal(null);
    take((version) => demand.table(name, version, kind, file, chosen.stem && part.trim()))
      .then(
        ({ label }) =>
          tell(kind === "office" ? `${file.name}: ${served(label)}` : t`${file.name} is imported.`),
        (error: unknown) => setRefusal({ file: file.name, problems: problemsOf(error) }),
      )
      .finally(() => setBusy(false));
  };
  return (
    <div className="fold">
      <Select
        label={t`Contents of the table`}
        data={Object.entries(KINDS()).map(([value, { label }]) => ({ value, label }))}
        value={kind}
        allowDeselect={false}
        onChange={choose}
      />
      <Text size="sm">{chosen.text}</Text>
      <div>
        <Text size="xs" c="dimmed">
          <Trans>For example, as text with commas, semicolons or tabs:</Trans>
        </Text>
        <pre className="example" tabIndex={0} aria-label={t`An example`}>
          {example}
        </pre>
        <Anchor
          size="sm"
          underline="always"
          href={`data:text/csv;charset=utf-8,${encodeURIComponent(example)}`}
          download={`${chosen.stem ?? "zones"}.csv`}
        >
          <Trans>Download this example</Trans>
        </Anchor>
      </div>
      {kind !== "profile" && (
        <Text size="xs" c="dimmed">
          <Trans>Point at a road or junction on the map to see its id for tables.</Trans>
        </Text>
      )}
      {chosen.stem && (
        <TextInput
          label={t`Name`}
          description={t`replaces what has this name already`}
          inputWrapperOrder={["label", "input", "description"]}
          value={part}
          onChange={(event) => setPart(event.currentTarget.value)}
        />
      )}
      {refusal && (
        <Alert
          ref={alert}
          color="red"
          title={t`${refusal.file} was not imported`}
          style={{ overflowWrap: "anywhere" }}
        >
          {refusal.problems.length === 1 ? (
            refusal.problems[0]
          ) : (
            <List size="sm">
              {refusal.problems.map((problem) => (
                <List.Item key={problem}>{problem}</List.Item>
              ))}
            </List>
          )}
        </Alert>
      )}
      <Group>
        <FileButton
          accept={kind === "office" ? undefined : ".csv,.tsv,.txt,text/csv"}
          resetRef={reset}
          onChange={send}
        >
          {(props) => (
            <Button variant="light" loading={busy} disabled={chosen.stem !== null && !part.trim()} {...props}>
              <Trans>Choose a table</Trans>
            </Button>
          )}
        </FileButton>
      </Group>
    </div>
  );
}

/** All reasons for a refusal; each begins with a capital letter. */
function problemsOf(error: unknown): string[] {
  const reported = error instanceof ApiError ? error.body.problems : [];
  return (reported.length > 0 ? reported.map(served) : [reasonOf(error)]).map(sentence);
}
