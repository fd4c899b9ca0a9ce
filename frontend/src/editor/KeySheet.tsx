import { Modal, Table } from "@mantine/core";

import { SHORTCUTS } from "./keys";

export function KeySheet({ open, onClose }: { open: boolean; onClose: () => void }) {
  return (
    <Modal opened={open} onClose={onClose} title="Keyboard shortcuts" centered size="lg">
      <Table>
        <Table.Tbody>
          {SHORTCUTS.map(([key, what]) => <Table.Tr key={key}><Table.Td><kbd>{key}</kbd></Table.Td><Table.Td>{what}</Table.Td></Table.Tr>)}
        </Table.Tbody>
      </Table>
    </Modal>
  );
}
