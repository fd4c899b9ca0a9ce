import {
  ActionIcon,
  Anchor,
  Badge,
  Button,
  Group,
  Modal,
  Table,
  Text,
  Title,
  VisuallyHidden,
} from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { recordings } from "../api/recordings";
import { recordedTime } from "../recordings/words";
import { hashOf } from "../ui/address";
import { IconTrash } from "../ui/icons";
import { tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";

/** Recordings that were opened before; nothing where there are none. */
export function Recordings() {
  const { value, reload } = useLoaded(recordings.list);
  const [removing, setRemoving] = useState<string | null>(null);
  if (!value || value.length === 0) return null;
  const remove = (name: string): void => {
    setRemoving(null);
    recordings.remove(name).then(reload, tellError);
  };
  return (
    <section aria-labelledby="recordings" style={{ marginTop: 34 }}>
      <Title order={2} size="h3" id="recordings" mb="sm">
        <Trans>Your recordings</Trans>
      </Title>
      <Table highlightOnHover verticalSpacing="xs" aria-labelledby="recordings">
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
              <Trans>Length</Trans>
            </Table.Th>
            <Table.Th>
              <VisuallyHidden>
                <Trans>Actions</Trans>
              </VisuallyHidden>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {value.map(({ name, map, road_users: users, begin, end }) => (
            <Table.Tr key={name}>
              <Table.Td>
                <Anchor href={hashOf({ view: "recording", recording: name })}>{name}</Anchor>
              </Table.Td>
              <Table.Td visibleFrom="sm">
                <Badge variant="default" tt="none">
                  {map ?? "?"}
                </Badge>
              </Table.Td>
              <Table.Td>{users}</Table.Td>
              <Table.Td visibleFrom="xs">
                {recordedTime({ begin: 0, end: end - begin }, end - begin)}
              </Table.Td>
              <Table.Td>
                <Group justify="flex-end">
                  <ActionIcon
                    variant="subtle"
                    color="gray"
                    aria-label={t`Delete ${name}`}
                    onClick={() => setRemoving(name)}
                  >
                    <IconTrash />
                  </ActionIcon>
                </Group>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      <Modal
        opened={removing !== null}
        onClose={() => setRemoving(null)}
        title={t`Delete the recording ${removing ?? ""}?`}
      >
        <Text size="sm" mb="md">
          <Trans>It does not go into the wastebasket. Scenarios that were made of it stay as they are.</Trans>
        </Text>
        <Group justify="flex-end">
          <Button variant="default" onClick={() => setRemoving(null)}>
            <Trans>Keep it</Trans>
          </Button>
          <Button color="red" onClick={() => removing !== null && remove(removing)}>
            <Trans>Delete it</Trans>
          </Button>
        </Group>
      </Modal>
    </section>
  );
}
