import { Alert, Anchor, Button, Loader, Table, Text, Title } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { api } from "../api/client";
import { type SweepInfo, sweeps } from "../api/sweeps";
import { hashOf } from "../ui/address";
import { useLearnedTitle, useTitle } from "../ui/titles";
import { useLoaded } from "../ui/useLoaded";
import { PlanForm } from "./PlanForm";
import { usePolledList } from "./usePolled";
import "./experiments.css";

/** The sweeps of one scenario, and a form for another one. */
export function SweepsView({ scenario }: { scenario: string }) {
  const { value, error } = useLoaded(useCallback(() => api.scenario(scenario), [scenario]));
  useLearnedTitle(scenario, value?.document.name);
  const title = useTitle(scenario);
  const editor = hashOf({ view: "editor", scenario });
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="md">
        <Trans>Sweeps of {title}</Trans>
      </Title>
      <Earlier scenario={scenario} />
      <Title order={2} size="h4" mt="lg" mb="xs">
        <Trans>New sweep</Trans>
      </Title>
      {error && (
        <Alert color="red" title={t`The scenario cannot be shown`}>
          {error}
        </Alert>
      )}
      {!value && !error && <Loader aria-label={t`Loading the scenario`} />}
      {value &&
        (Object.keys(value.document.parameters).length > 0 ? (
          <PlanForm scenario={scenario} document={value.document} />
        ) : (
          <>
            <Text mb="sm">
              <Trans>
                A sweep varies the parameters of a scenario, and this one has none. In the step Parameters of
                the editor, any of its numbers can become one.
              </Trans>
            </Text>
            <Button component="a" href={editor}>
              <Trans>To the editor</Trans>
            </Button>
          </>
        ))}
      <Anchor display="block" mt="lg" href={editor}>
        <Trans>Back to the editor</Trans>
      </Anchor>
    </div>
  );
}

function Earlier({ scenario }: { scenario: string }) {
  const { value, error } = usePolledList(useCallback(() => sweeps.list(scenario), [scenario]));
  if (error)
    return (
      <Alert color="red" title={t`The sweeps cannot be shown`}>
        {error}
      </Alert>
    );
  if (!value || value.length === 0) return null;
  return (
    <Table verticalSpacing={6} fz={14} aria-label={t`Sweeps of this scenario`}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>
            <Trans>Sweep</Trans>
          </Table.Th>
          <Table.Th>
            <Trans>Parameters</Trans>
          </Table.Th>
          <Table.Th>
            <Trans>Outcome</Trans>
          </Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {[...value].reverse().map((one) => (
          <Table.Tr key={one.sweep}>
            <Table.Td>
              <Anchor size="sm" href={hashOf({ view: "sweep", scenario, sweep: one.sweep })}>
                {one.sweep}
              </Anchor>
            </Table.Td>
            <Table.Td>{one.parameters.join(", ")}</Table.Td>
            <Table.Td>{outcome(one)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}

function outcome({ state, cases, ended, safe, unsafe }: SweepInfo): string {
  if (state === "done") return t`${safe ?? 0} of ${(safe ?? 0) + (unsafe ?? 0)} cases safe`;
  const far = t`${ended} of ${plural(cases, { one: "# case", other: "# cases" })}`;
  return state === "running" ? t`running, ${far}` : `${state}, ${far}`;
}
