import { Alert, Button, Group, Progress, Table, Text, Title } from "@mantine/core";
import { useState } from "react";

import { type RunInfo, runs, type Summary } from "../api/runs";
import { tellError } from "../ui/notices";
import { hoursMinutes, span } from "../ui/words";

/** A long run that was interrupted: how much is saved, and resuming it. */
export function Interrupted({
  info,
  onBack,
  onResume,
}: {
  info: RunInfo;
  onBack: () => void;
  onResume: () => void;
}) {
  const [busy, setBusy] = useState(false);
  const { progress, slices } = info;
  const until = progress?.until ?? 0;
  const saved = slices?.time ?? 0;
  const words = info.error;
  const resume = (): void => {
    setBusy(true);
    runs.resume(info.run).then(onResume, (error: unknown) => {
      setBusy(false);
      tellError(error);
    });
  };
  return (
    <section aria-label="Result of the run">
      <Title order={2} size="h3">
        The run was interrupted
      </Title>
      <Text size="sm" mt="sm">
        {saved > 0 ? (
          <>
            {hoursMinutes(saved)} of {hoursMinutes(until)} are completed and saved. The run resumes from
            there, with the same results as without the interruption.
          </>
        ) : (
          "It did not complete its first hour and starts again from the beginning."
        )}
      </Text>
      <Progress mt="sm" value={until ? (100 * saved) / until : 0} aria-label="Progress of the run" />
      <Group mt="md" mb="lg" gap="xs">
        <Button loading={busy} onClick={resume}>
          Resume
        </Button>
        <Button variant="default" onClick={onBack}>
          Back to the editor
        </Button>
      </Group>
      {words && (
        <details className="words">
          <summary>Why it was interrupted</summary>
          <pre tabIndex={0}>{words}</pre>
        </details>
      )}
    </section>
  );
}

/** What is saved of a long run. */
export function SafeSlices({ info }: { info: RunInfo }) {
  const { slices, progress } = info;
  if (!slices || !progress || slices.length <= 0) return null;
  const total = Math.ceil(progress.until / slices.length);
  return (
    <Alert
      color="blue"
      variant="light"
      mb="md"
      role="status"
      title={
        slices.done === 0 ? "Nothing is saved yet" : `${slices.done} of ${total} parts completed and saved`
      }
    >
      <Text size="sm">
        A part is {hoursMinutes(slices.length)}. If the run is interrupted, it can be resumed from{" "}
        {slices.done === 0 ? "its beginning" : hoursMinutes(slices.time)}.
      </Text>
    </Alert>
  );
}

/** The parts of a long run that has ended, one row each. */
export function SliceTable({ summary }: { summary: Summary }) {
  const done = summary.slices?.done ?? [];
  if (done.length === 0) return null;
  return (
    <details className="words" style={{ marginTop: 18 }}>
      <summary>The {done.length} parts of the run</summary>
      <Text size="xs" c="dimmed">
        Road users on the road at the end of each part, and what it cost to compute.
      </Text>
      <Table mt="xs" verticalSpacing={3} fz={13} aria-label="Parts of the run">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Part</Table.Th>
            <Table.Th ta="right">On the road</Table.Th>
            <Table.Th ta="right">Computed in</Table.Th>
            <Table.Th ta="right">Memory</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {done.map((one, n) => (
            <Table.Tr key={one.time}>
              <Table.Th scope="row" fw={400} style={{ whiteSpace: "nowrap" }}>
                {span(done[n - 1]?.time ?? 0, one.time)}
              </Table.Th>
              <Table.Td ta="right">{one.running.toLocaleString("en")}</Table.Td>
              <Table.Td ta="right" style={{ whiteSpace: "nowrap" }}>
                {(one.wall_seconds - (done[n - 1]?.wall_seconds ?? 0)).toFixed(1)} s
              </Table.Td>
              <Table.Td ta="right">{Math.round(one.memory_mb).toLocaleString("en")} MB</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </details>
  );
}
