import {
  ActionIcon,
  Anchor,
  Badge,
  Button,
  FileButton,
  Group,
  Table,
  Text,
  Title,
  VisuallyHidden,
} from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { api } from "../api/client";
import type { ScenarioEntry } from "../api/types";
import { ImportWork, RECORDED_FILES, XOSC_FILES } from "../exchange/ImportWork";
import { type Import, RECORDED } from "../exchange/useImport";
import { IconTrash } from "../ui/icons";
import { tellError } from "../ui/notices";
import { go, hashOf } from "../ui/address";
import { when } from "../run/figures";
import { served } from "../language/served";
import { repeatedTitles, titleOf } from "./titles";

/** So many are listed before the maps, the newest first. */
const MOST = 6;

/** The scenarios there are; one can be opened from a file. */
export function Scenarios({
  list,
  importing,
  onRemove,
}: {
  list: ScenarioEntry[];
  importing: Import;
  onRemove: (name: string) => void;
}) {
  const [busy, setBusy] = useState(false);
  const [whole, setWhole] = useState(false);
  const newest = [...list].sort((a, b) => b.modified - a.modified);
  const shown = whole || list.length <= MOST + 1 ? newest : newest.slice(0, MOST);
  const ambiguous = repeatedTitles(list);
  const bring = (file: File | null): void => {
    if (!file) return;
    setBusy(true);
    api.uploadScenario(file).then(
      (made) => go({ view: "editor", scenario: made.name }),
      (error: unknown) => {
        setBusy(false);
        tellError(error);
      },
    );
  };
  return (
    <section aria-labelledby="scenarios" style={{ marginTop: list.length > 0 ? 0 : 34 }}>
      <Group justify="space-between" mb="sm">
        <Title order={list.length > 0 ? 1 : 2} size={list.length > 0 ? "h2" : "h3"} id="scenarios">
          <Trans>Your scenarios</Trans>
        </Title>
        <Group gap="sm">
          <Button component="a" variant="default" size="sm" href={hashOf({ view: "studies" })}>
            <Trans>Studies</Trans>
          </Button>
          <FileButton multiple accept={XOSC_FILES} onChange={(files) => importing.begin(files)}>
            {(props) => (
              <Button variant="default" size="sm" disabled={importing.state?.refusal === null} {...props}>
                <Trans>Import OpenSCENARIO</Trans>
              </Button>
            )}
          </FileButton>
          <FileButton multiple accept={RECORDED_FILES} onChange={(files) => importing.begin(files, RECORDED)}>
            {(props) => (
              <Button variant="default" size="sm" disabled={importing.state?.refusal === null} {...props}>
                <Trans>Open a recording</Trans>
              </Button>
            )}
          </FileButton>
          <FileButton accept=".json,.graphml" onChange={bring}>
            {(props) => (
              <Button variant="default" size="sm" loading={busy} {...props}>
                <Trans>Open a scenario file</Trans>
              </Button>
            )}
          </FileButton>
        </Group>
      </Group>
      <ImportWork work={importing} />
      {list.length === 0 ? (
        <Text c="dimmed">
          <Trans>None yet. Choose a map above, or open a scenario file.</Trans>
        </Text>
      ) : (
        <Table highlightOnHover verticalSpacing="xs" aria-labelledby="scenarios">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>
                <Trans>Name</Trans>
              </Table.Th>
              <Table.Th visibleFrom="sm">
                <Trans>Map</Trans>
              </Table.Th>
              <Table.Th>
                <Trans>Road users</Trans>
              </Table.Th>
              <Table.Th visibleFrom="xs">
                <Trans>Changed</Trans>
              </Table.Th>
              <Table.Th>
                <VisuallyHidden>
                  <Trans>Actions</Trans>
                </VisuallyHidden>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {shown.map((one) => (
              <Table.Tr key={one.name}>
                <Table.Td>
                  <Anchor href={hashOf({ view: "editor", scenario: one.name })}>{titleOf(one)}</Anchor>
                  {ambiguous.has(titleOf(one)) && one.title !== one.name && (
                    <Text span size="xs" c="dimmed" ml={8}>
                      {one.name}
                    </Text>
                  )}
                  {one.error && (
                    <Text size="xs" c="red">
                      {served(one.error)}
                    </Text>
                  )}
                </Table.Td>
                <Table.Td visibleFrom="sm">
                  <Badge variant="default" tt="none">
                    {one.map ?? "?"}
                  </Badge>
                </Table.Td>
                <Table.Td>{one.actors}</Table.Td>
                <Table.Td visibleFrom="xs">{when(one.modified)}</Table.Td>
                <Table.Td>
                  <Group gap={12} justify="flex-end" wrap="nowrap">
                    <Anchor
                      size="sm"
                      href={hashOf({ view: "runs", scenario: one.name })}
                      aria-label={t`Runs of ${one.name}`}
                    >
                      <Trans>Runs</Trans>
                    </Anchor>
                    <ActionIcon
                      variant="subtle"
                      color="gray"
                      aria-label={t`Remove ${one.name}`}
                      onClick={() => onRemove(one.name)}
                    >
                      <IconTrash />
                    </ActionIcon>
                  </Group>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      )}
      {shown.length < list.length && (
        <Button variant="subtle" size="compact-sm" mt={6} onClick={() => setWhole(true)}>
          <Trans>Show all {list.length} scenarios</Trans>
        </Button>
      )}
    </section>
  );
}
