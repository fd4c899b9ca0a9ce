import { Modal, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type KeyboardEvent, useId, useMemo, useState } from "react";

import type { Actor, Flow } from "../api/types";
import type { Graph } from "../map/graph";
import { IconSearch } from "../ui/icons";
import { findAll, type Found } from "./find";

/** Goes to a road, a junction or a road user by its name; arrow keys choose among what is found. */
export function FindDialog({
  graph,
  ones,
  onGo,
  onClose,
}: {
  graph: Graph;
  ones: readonly (Actor | Flow)[];
  onGo: (found: Found) => void;
  onClose: () => void;
}) {
  const [search, setSearch] = useState("");
  const [at, setAt] = useState(0);
  const list = useId();
  const found = useMemo(() => findAll(graph, ones, search), [graph, ones, search]);
  const chosen = Math.min(at, found.length - 1);
  const go = (one: Found | undefined): void => {
    if (!one) return;
    onClose();
    onGo(one);
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) setAt(Math.max(0, Math.min(chosen + step, found.length - 1)));
    else if (event.key === "Enter") go(found[chosen]);
    else return;
    event.preventDefault();
  };
  return (
    <Modal opened onClose={onClose} title={t`Find a road, a junction or a road user`} yOffset="12vh">
      <TextInput
        data-autofocus
        leftSection={<IconSearch />}
        aria-label={t`Name`}
        placeholder={t`Such as 12, junction 5, car-3 or bus`}
        value={search}
        role="combobox"
        aria-expanded={found.length > 0}
        aria-controls={list}
        aria-activedescendant={found.length > 0 ? `${list}-${chosen}` : undefined}
        onChange={(event) => {
          setSearch(event.currentTarget.value);
          setAt(0);
        }}
        onKeyDown={onKeyDown}
      />
      <div className="found" role="listbox" id={list} aria-label={t`Found`}>
        {found.map((one, n) => (
          <div
            key={`${one.is} ${one.id}`}
            id={`${list}-${n}`}
            role="option"
            aria-selected={n === chosen}
            onClick={() => go(one)}
          >
            <b>{one.id}</b>
            <span>{one.kind}</span>
          </div>
        ))}
      </div>
      {search.trim() && found.length === 0 && (
        <Text size="sm" role="status">
          <Trans>Nothing on this map or in this scenario is called “{search.trim()}”.</Trans>
        </Text>
      )}
    </Modal>
  );
}
