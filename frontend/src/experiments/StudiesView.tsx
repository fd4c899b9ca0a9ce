import { Alert, Anchor, Loader, Table, Text, Title } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { studies } from "../api/studies";
import { hashOf } from "../ui/address";
import { outcomeWord } from "./groups";
import { StudyForm } from "./StudyForm";
import { usePolledList } from "./usePolled";
import "./experiments.css";

/** All studies, and a form for another one. */
export function StudiesView() {
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="xs">
        <Trans>Studies</Trans>
      </Title>
      <Text c="dimmed" mb="md">
        <Trans>
          Many runs of your scenarios, with several seeds and kinds of weather, and one table of all figures.
        </Trans>
      </Text>
      <Earlier />
      <Title order={2} size="h4" mt="lg" mb="xs">
        <Trans>New study</Trans>
      </Title>
      <StudyForm />
    </div>
  );
}

function Earlier() {
  const { value, error } = usePolledList(studies.list);
  if (error)
    return (
      <Alert color="red" title={t`The studies cannot be shown`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Loading the studies`} />;
  if (value.length === 0) return null;
  return (
    <Table verticalSpacing={6} fz={14} aria-label={t`Studies`}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>
            <Trans>Study</Trans>
          </Table.Th>
          <Table.Th>
            <Trans>Of</Trans>
          </Table.Th>
          <Table.Th>
            <Trans>Outcome</Trans>
          </Table.Th>
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
              {plural(one.scenarios.length, { one: "# scenario", other: "# scenarios" })},{" "}
              {plural(one.seeds, { one: "# seed", other: "# seeds" })}
            </Table.Td>
            <Table.Td>{outcomeWord(one)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
