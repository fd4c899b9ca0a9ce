import { Alert, Anchor, Loader, Table, Text, Title } from "@mantine/core";
import { useEffect } from "react";

import { studies } from "../api/studies";
import { hashOf } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { count } from "../ui/words";
import { outcomeWord } from "./groups";
import { StudyForm } from "./StudyForm";
import { POLL } from "./useStudy";
import "../sweeps/sweeps.css";
import "./studies.css";

/** All studies, and a form for another one. */
export function StudiesView() {
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="xs">
        Studies
      </Title>
      <Text c="dimmed" mb="md">
        Many runs of your scenarios, with several seeds and kinds of weather, and one table of all figures.
      </Text>
      <Earlier />
      <Title order={2} size="h4" mt="lg" mb="xs">
        New study
      </Title>
      <StudyForm />
    </div>
  );
}

function Earlier() {
  const { value, error, reload } = useLoaded(studies.list);
  const live = value?.some(({ state }) => state === "running") ?? false;
  useEffect(() => {
    if (!live) return;
    const timer = setInterval(reload, 2 * POLL);
    return () => clearInterval(timer);
  }, [live, reload]);
  if (error)
    return (
      <Alert color="red" title="The studies cannot be shown">
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label="Loading the studies" />;
  if (value.length === 0) return null;
  return (
    <Table verticalSpacing={6} fz={14} aria-label="Studies">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>Study</Table.Th>
          <Table.Th>Of</Table.Th>
          <Table.Th>Outcome</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {[...value].reverse().map((one) => (
          <Table.Tr key={one.study}>
            <Table.Td>
              <Anchor size="sm" href={hashOf({ view: "study", study: one.study })}>
                {one.study}
              </Anchor>
            </Table.Td>
            <Table.Td>
              {count(one.scenarios.length, "scenario")}, {count(one.seeds, "seed")}
            </Table.Td>
            <Table.Td>{outcomeWord(one)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
