import { Alert, Anchor, Button, Loader, Table, Text, Title } from "@mantine/core";
import { useCallback, useEffect } from "react";

import { api } from "../api/client";
import { type SweepInfo, sweeps } from "../api/sweeps";
import { hashOf } from "../ui/address";
import { useLearnedTitle, useTitle } from "../ui/titles";
import { useLoaded } from "../ui/useLoaded";
import { count } from "../ui/words";
import { PlanForm } from "./PlanForm";
import { POLL } from "./useSweep";
import "./sweeps.css";

/** The sweeps of one scenario, and a form for another one. */
export function SweepsView({ scenario }: { scenario: string }) {
  const { value, error } = useLoaded(useCallback(() => api.scenario(scenario), [scenario]));
  useLearnedTitle(scenario, value?.document.name);
  const title = useTitle(scenario);
  const editor = hashOf({ view: "editor", scenario });
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="md">
        Sweeps of {title}
      </Title>
      <Earlier scenario={scenario} />
      <Title order={2} size="h4" mt="lg" mb="xs">
        New sweep
      </Title>
      {error && (
        <Alert color="red" title="The scenario cannot be shown">
          {error}
        </Alert>
      )}
      {!value && !error && <Loader aria-label="Loading the scenario" />}
      {value &&
        (Object.keys(value.document.parameters).length > 0 ? (
          <PlanForm scenario={scenario} document={value.document} />
        ) : (
          <>
            <Text mb="sm">
              A sweep varies the parameters of a scenario, and this one has none. In the step Parameters of
              the editor, any of its numbers can become one.
            </Text>
            <Button component="a" href={editor}>
              To the editor
            </Button>
          </>
        ))}
      <Anchor display="block" mt="lg" href={editor}>
        Back to the editor
      </Anchor>
    </div>
  );
}

function Earlier({ scenario }: { scenario: string }) {
  const { value, error, reload } = useLoaded(useCallback(() => sweeps.list(scenario), [scenario]));
  const live = value?.some(({ state }) => state === "running") ?? false;
  useEffect(() => {
    if (!live) return;
    const timer = setInterval(reload, 2 * POLL);
    return () => clearInterval(timer);
  }, [live, reload]);
  if (error)
    return (
      <Alert color="red" title="The sweeps cannot be shown">
        {error}
      </Alert>
    );
  if (!value || value.length === 0) return null;
  return (
    <Table verticalSpacing={6} fz={14} aria-label="Sweeps of this scenario">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>Sweep</Table.Th>
          <Table.Th>Parameters</Table.Th>
          <Table.Th>Outcome</Table.Th>
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
  if (state === "done") return `${safe ?? 0} of ${(safe ?? 0) + (unsafe ?? 0)} cases safe`;
  const far = `${ended} of ${count(cases, "case")}`;
  return state === "running" ? `running, ${far}` : `${state}, ${far}`;
}
