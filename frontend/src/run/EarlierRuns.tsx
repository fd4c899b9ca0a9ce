import { ActionIcon, Alert, Anchor, Group, Loader, Table, Text, VisuallyHidden } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback, useEffect, useState } from "react";

import { type RunInfo, runs } from "../api/runs";
import { IconTrash } from "../ui/icons";
import { RemovalDialog, type ToRemove } from "../ui/RemovalDialog";
import { hashOf } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { verdictWord } from "../ui/words";
import { hasEnded, STATE_WORD, when } from "./figures";

/** How often the list is asked for while a run in it is live, milliseconds. */
const POLL = 2000;

/** All runs of a scenario, the newest first: watch, read, remove. */
export function EarlierRuns({
  scenario,
  current,
  onRemoved,
}: {
  scenario: string;
  current?: string;
  onRemoved?: (run: string) => void;
}) {
  const { value, error, reload } = useLoaded(useCallback(() => runs.list(scenario), [scenario]));
  const live = value?.some((one) => !hasEnded(one.state)) ?? false;
  useEffect(() => {
    if (!live) return;
    const timer = setInterval(reload, POLL);
    return () => clearInterval(timer);
  }, [live, reload]);
  const [removing, setRemoving] = useState<ToRemove | null>(null);
  if (error)
    return (
      <Alert color="red" title={t`The runs cannot be shown`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Loading the runs`} />;
  if (value.length === 0)
    return (
      <Text c="dimmed">
        <Trans>This scenario has not been run yet. Start a run in the editor, in its last step.</Trans>
      </Text>
    );
  return (
    <>
      <Table verticalSpacing={6} fz={14} aria-label={t`Runs of this scenario`}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>
              <Trans>Ended</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Outcome</Trans>
            </Table.Th>
            <Table.Th>
              <VisuallyHidden>
                <Trans>Actions</Trans>
              </VisuallyHidden>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {[...value].reverse().map((one) => (
            <Table.Tr key={one.run} title={one.run}>
              <Table.Td>{one.finished ? when(one.finished) : t`now`}</Table.Td>
              <Table.Td>{outcome(one)}</Table.Td>
              <Table.Td>
                <Group gap={10} justify="flex-end" wrap="nowrap">
                  {one.run === current ? (
                    <Text size="sm" fw={600}>
                      <Trans>shown</Trans>
                    </Text>
                  ) : (
                    <Anchor
                      size="sm"
                      href={hashOf({ view: "run", scenario, run: one.run })}
                      aria-label={`${watchWord(one)} ${one.run}`}
                    >
                      {one.state === "interrupted" ? t`Resume` : t`Watch`}
                    </Anchor>
                  )}
                  {hasReport(one) && (
                    <Anchor
                      size="sm"
                      href={runs.reportUrl(one.run)}
                      target="_blank"
                      rel="noreferrer"
                      aria-label={t`Report of ${one.run}`}
                    >
                      <Trans>Report</Trans>
                    </Anchor>
                  )}
                  {hasEnded(one.state) && (
                    <ActionIcon
                      variant="subtle"
                      color="gray"
                      aria-label={t`Remove ${one.run}`}
                      onClick={() => setRemoving({ kind: "run", name: one.run })}
                    >
                      <IconTrash />
                    </ActionIcon>
                  )}
                </Group>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      <RemovalDialog
        what={removing}
        onClose={() => setRemoving(null)}
        onChanged={(what, there) => {
          reload();
          if (!there) onRemoved?.(what.name);
        }}
      />
    </>
  );
}

const outcome = ({ state, summary }: RunInfo): string =>
  (state === "completed" || state === "stopped") && summary?.usable
    ? `${STATE_WORD()[state]}, ${verdictWord(summary.usable.level)}`
    : STATE_WORD()[state];
const watchWord = ({ state }: RunInfo): string => (state === "interrupted" ? t`Resume` : t`Watch`);
const hasReport = ({ state }: RunInfo): boolean => state === "completed" || state === "stopped";
