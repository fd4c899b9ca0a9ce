import type { ComboboxItem, OptionsFilter } from "@mantine/core";

import type { PlaceNames } from "../map/placeNames";

/** Choices whose name or id has what is typed in it. */
export const byNameOrId: OptionsFilter = ({ options, search, limit }) => {
  const wanted = search.trim().toLowerCase();
  const has = (text: string): boolean => text.toLowerCase().includes(wanted);
  return (options as ComboboxItem[]).filter(({ value, label }) => has(label) || has(value)).slice(0, limit);
};

/** Junctions by their names. */
export const junctionChoices = (places: PlaceNames, junctions: readonly string[]): ComboboxItem[] =>
  junctions
    .map((value) => ({ value, label: places.junction(value) }))
    .sort((a, b) => a.label.localeCompare(b.label, undefined, { numeric: true }));
