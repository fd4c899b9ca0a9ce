import { ActionIcon, Table } from "@mantine/core";

import type { Actor, Edit } from "../api/types";
import { CategoryGlyph, IconTrash } from "../ui/icons";
import { CATEGORY_WORD, kmh, modelWord, STYLE_WORD } from "../ui/words";

/** Everybody in the scenario; choosing a row is choosing on the map. */
export function ActorTable({ actors, selection, onSelect, onEdit }: {
  actors: readonly Actor[]; selection: readonly string[];
  onSelect: (id: string, more: boolean) => void; onEdit: (edit: Edit) => void;
}) {
  return (
    <Table stickyHeader highlightOnHover verticalSpacing={4} fz="sm">
      <Table.Thead>
        <Table.Tr>
          {["Name", "Kind", "Model", "Start", "Goal", "Speed", "Starts after", "Style", "Ego"].map((word) => <Table.Th key={word}>{word}</Table.Th>)}
          <Table.Th><span aria-label="Remove" /></Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {actors.map((actor) => (
          <Table.Tr key={actor.id} data-selected={selection.includes(actor.id)} style={{ cursor: "pointer" }}
            onClick={(event) => onSelect(actor.id, event.shiftKey || event.ctrlKey)}>
            <Table.Td>
              <button type="button" className="row-button" aria-pressed={selection.includes(actor.id)}
                onClick={(event) => { event.stopPropagation(); onSelect(actor.id, event.shiftKey || event.ctrlKey); }}>{actor.id}</button>
            </Table.Td>
            <Table.Td><span className="kind"><CategoryGlyph category={actor.category} size={22} />{CATEGORY_WORD[actor.category]}</span></Table.Td>
            <Table.Td>{actor.model ? modelWord(actor.model) : "any"}</Table.Td>
            <Table.Td>{actor.spawn}</Table.Td>
            <Table.Td>{actor.goal ?? "by chance"}</Table.Td>
            <Table.Td>{actor.speed === null ? (actor.category === "pedestrian" ? "usual" : "the limit") : kmh(actor.speed)}</Table.Td>
            <Table.Td>{actor.depart} s</Table.Td>
            <Table.Td>{actor.category === "pedestrian" ? "–" : STYLE_WORD[actor.style]}</Table.Td>
            <Table.Td>{actor.ego ? "yes" : ""}</Table.Td>
            <Table.Td ta="right">
              <ActionIcon size="sm" variant="subtle" color="gray" aria-label={`Remove ${actor.id}`}
                onClick={(event) => { event.stopPropagation(); onEdit({ kind: "remove_actors", actors: [actor.id] }); }}><IconTrash size={15} /></ActionIcon>
            </Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
