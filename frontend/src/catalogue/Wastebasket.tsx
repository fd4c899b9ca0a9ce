import { Alert, Button, Group, Loader, Modal, Table, Text, VisuallyHidden } from "@mantine/core";
import { useState } from "react";

import { type Kind, type Removed, removal } from "../api/removal";
import { when } from "../run/figures";
import { tell, tellError } from "../ui/notices";
import { useLoaded } from "../ui/useLoaded";
import { bytes } from "../ui/words";

const KIND_WORD: Record<Kind, string> = { map: "Map", scenario: "Scenario", run: "Run" };

/** What was removed, to be restored or deleted for good. */
export function Wastebasket({ onClose, onRestored }: { onClose: () => void; onRestored: () => void }) {
  const { value, error, reload } = useLoaded(removal.trash);
  const [deleting, setDeleting] = useState<string | null>(null);
  const restore = (item: Removed): void => {
    removal.restore(item.id).then(() => {
      tell(`${item.name} is back.`);
      reload();
      onRestored();
    }, tellError);
  };
  const deleteForGood = (item: Removed): void => {
    setDeleting(null);
    removal.deleteForGood(item.id).then(() => {
      tell(`${item.name} is deleted.`);
      reload();
    }, tellError);
  };
  return (
    <Modal opened onClose={onClose} size="xl" title="Wastebasket">
      {error && <Alert color="red">{error}</Alert>}
      {!value && !error && <Loader aria-label="Loading the wastebasket" />}
      {value?.length === 0 && <Text c="dimmed">The wastebasket is empty.</Text>}
      {value && value.length > 0 && (
        <Table verticalSpacing={6} fz={14} aria-label="Wastebasket">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Name</Table.Th>
              <Table.Th>Kind</Table.Th>
              <Table.Th>Removed</Table.Th>
              <Table.Th>Kept until</Table.Th>
              <Table.Th>Size</Table.Th>
              <Table.Th>
                <VisuallyHidden>Actions</VisuallyHidden>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {value.map((item) => (
              <Table.Tr key={item.id}>
                <Table.Td style={{ overflowWrap: "anywhere", minWidth: 160 }}>{item.name}</Table.Td>
                <Table.Td>{KIND_WORD[item.kind]}</Table.Td>
                <Table.Td>{when(item.removed)}</Table.Td>
                <Table.Td>{when(item.until)}</Table.Td>
                <Table.Td style={{ whiteSpace: "nowrap" }}>{bytes(item.size)}</Table.Td>
                <Table.Td>
                  <Group gap={6} justify="flex-end" wrap="nowrap">
                    {deleting === item.id ? (
                      <>
                        <Button
                          size="compact-sm"
                          variant="default"
                          data-autofocus
                          onClick={() => setDeleting(null)}
                        >
                          Keep it
                        </Button>
                        <Button
                          size="compact-sm"
                          color="red"
                          aria-label={`Delete ${item.name} for good`}
                          onClick={() => deleteForGood(item)}
                        >
                          Delete for good
                        </Button>
                      </>
                    ) : (
                      <>
                        <Button
                          size="compact-sm"
                          variant="light"
                          aria-label={`Restore ${item.name}`}
                          onClick={() => restore(item)}
                        >
                          Restore
                        </Button>
                        <Button
                          size="compact-sm"
                          variant="subtle"
                          color="red"
                          aria-label={`Delete ${item.name}`}
                          onClick={() => setDeleting(item.id)}
                        >
                          Delete
                        </Button>
                      </>
                    )}
                  </Group>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      )}
    </Modal>
  );
}
