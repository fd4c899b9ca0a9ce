import { Alert, Anchor, Loader, Table, Text, Title, VisuallyHidden } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { allFigures } from "../api/figures";
import { type RunInfo, runs, type Summary } from "../api/runs";
import { hashOf } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { compared, when } from "./figures";

interface Last {
  info: RunInfo;
  summary: Summary;
  changed: boolean;
}

/** The key figures beside those of the run of this scenario before it. */
export function Comparison({ info, scenario }: { info: RunInfo; scenario: string }) {
  const { run, finished, summary } = info;
  const load = useCallback(() => lastBefore(scenario, run, finished ?? Infinity), [scenario, run, finished]);
  const { value, error } = useLoaded(load);
  const known = useLoaded(allFigures);
  if (error ?? known.error)
    return (
      <Alert color="gray" title={t`Earlier runs cannot be compared`}>
        {error ?? known.error}
      </Alert>
    );
  if (!value || !known.value) return <Loader aria-label={t`Looking for the last run`} />;
  const [last] = value;
  if (!summary || !last) {
    return (
      <Text size="sm" c="dimmed">
        <Trans>
          This is the first run of this scenario. After the next one, both are shown beside each other here.
        </Trans>
      </Text>
    );
  }
  return (
    <>
      <Title order={3} size="h5">
        <Trans>Compared with the last run</Trans>
      </Title>
      <Text size="sm" mt={4}>
        <Anchor underline="always" href={hashOf({ view: "run", scenario, run: last.info.run })}>
          {last.info.finished ? when(last.info.finished) : last.info.run}
        </Anchor>
        . {last.changed ? t`The scenario was changed in between.` : t`The scenario is the same.`}
      </Text>
      <Table mt="xs" verticalSpacing={4} fz={13} aria-label={t`Compared with the last run`}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>
              <VisuallyHidden>
                <Trans>Figure</Trans>
              </VisuallyHidden>
            </Table.Th>
            <Table.Th>
              <Trans>This run</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Last run</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Difference</Trans>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {compared(summary, last.summary, known.value).map((one) => (
            <Table.Tr key={one.name}>
              <Table.Th scope="row" fw={400} title={one.definition}>
                {one.label}
              </Table.Th>
              <Table.Td>{one.value}</Table.Td>
              <Table.Td>{one.before}</Table.Td>
              <Table.Td fw={one.difference === "same" ? 400 : 700}>
                {one.difference}
                {one.better === null ? "" : one.better ? t`, better` : t`, worse`}
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </>
  );
}

/** The run before this one that has figures, if there is one: a list of one or none. */
async function lastBefore(scenario: string, run: string, finished: number): Promise<Last[]> {
  const earlier = (await runs.list(scenario)).filter(
    (one) => one.run !== run && one.state !== "failed" && one.finished != null && one.finished < finished,
  );
  const newest = earlier.sort((a, b) => (b.finished ?? 0) - (a.finished ?? 0))[0];
  if (!newest) return [];
  const [info, here, there] = await Promise.all([
    runs.info(newest.run),
    runs.content(run),
    runs.content(newest.run),
  ]);
  return info.summary ? [{ info, summary: info.summary, changed: here.digest !== there.digest }] : [];
}
