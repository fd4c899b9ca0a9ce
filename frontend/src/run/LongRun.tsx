import { i18n } from "@lingui/core";
import { Alert, Button, Group, Progress, Table, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { fixed } from "../language/numbers";
import { type RunInfo, runs, type Summary } from "../api/runs";
import { tellError } from "../ui/notices";
import { span } from "../language/moments";
import { hoursMinutes } from "../ui/words";
import { served } from "../language/served";

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
    <section aria-label={t`Result of the run`}>
      <Title order={2} size="h3">
        <Trans>The run was interrupted</Trans>
      </Title>
      <Text size="sm" mt="sm">
        {saved > 0 ? (
          <Trans>
            {hoursMinutes(saved)} of {hoursMinutes(until)} are completed and saved. The run resumes from
            there, with the same results as without the interruption.
          </Trans>
        ) : (
          t`It did not complete its first hour and starts again from the beginning.`
        )}
      </Text>
      <Progress mt="sm" value={until ? (100 * saved) / until : 0} aria-label={t`Progress of the run`} />
      <Group mt="md" mb="lg" gap="xs">
        <Button loading={busy} onClick={resume}>
          <Trans>Resume</Trans>
        </Button>
        <Button variant="default" onClick={onBack}>
          <Trans>Back to the editor</Trans>
        </Button>
      </Group>
      {words && (
        <details className="words">
          <summary>
            <Trans>Why it was interrupted</Trans>
          </summary>
          <pre tabIndex={0}>{served(words)}</pre>
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
        slices.done === 0 ? t`Nothing is saved yet` : t`${slices.done} of ${total} parts completed and saved`
      }
    >
      <Text size="sm">
        {slices.done === 0
          ? t`A part is ${hoursMinutes(slices.length)}. If the run is interrupted, it can be resumed from its beginning.`
          : t`A part is ${hoursMinutes(slices.length)}. If the run is interrupted, it can be resumed from ${hoursMinutes(slices.time)}.`}
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
      <summary>
        <Trans>The {done.length} parts of the run</Trans>
      </summary>
      <Text size="xs" c="dimmed">
        <Trans>Road users on the road at the end of each part, and what it cost to compute.</Trans>
      </Text>
      <Table mt="xs" verticalSpacing={3} fz={13} aria-label={t`Parts of the run`}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>
              <Trans>Part</Trans>
            </Table.Th>
            <Table.Th ta="right">
              <Trans>On the road</Trans>
            </Table.Th>
            <Table.Th ta="right">
              <Trans>Computed in</Trans>
            </Table.Th>
            <Table.Th ta="right">
              <Trans>Memory</Trans>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {done.map((one, n) => (
            <Table.Tr key={one.time}>
              <Table.Th scope="row" fw={400} style={{ whiteSpace: "nowrap" }}>
                {span(done[n - 1]?.time ?? 0, one.time)}
              </Table.Th>
              <Table.Td ta="right">{one.running.toLocaleString(i18n.locale)}</Table.Td>
              <Table.Td ta="right" style={{ whiteSpace: "nowrap" }}>
                <Trans>{fixed(one.wall_seconds - (done[n - 1]?.wall_seconds ?? 0), 1)} s</Trans>
              </Table.Td>
              <Table.Td ta="right">
                <Trans>{Math.round(one.memory_mb).toLocaleString(i18n.locale)} MB</Trans>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </details>
  );
}
