import { Modal, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type KeyboardEvent, useEffect, useId, useMemo, useRef, useState } from "react";

import type { Actor, Flow } from "../api/types";
import type { Graph } from "../map/graph";
import { IconSearch } from "../ui/icons";
import { type Command, findCommands } from "./commands";
import { findAll, type Found } from "./find";

/** Something that is listed: a place or road user, or a command. */
type Entry = { found: Found } | { command: Command };

/** The kind, with the id if that is not the name. */
const ofFound = ({ kind, id, name }: Found): string => (name === id ? kind : `${kind} ${id}`);

/**
 * Goes to a road, a junction or a road user by its name, or does what is named; arrow keys choose among
 * what is found.
 */
export function FindDialog({
  graph,
  ones,
  commands,
  onGo,
  onClose,
}: {
  graph: Graph;
  ones: readonly (Actor | Flow)[];
  commands: readonly Command[];
  onGo: (found: Found) => void;
  onClose: () => void;
}) {
  const [search, setSearch] = useState("");
  const [at, setAt] = useState(0);
  const list = useId();
  const found = useMemo<Entry[]>(
    () => [
      ...findAll(graph, ones, search).map((one) => ({ found: one })),
      ...findCommands(commands, search).map((one) => ({ command: one })),
    ],
    [graph, ones, commands, search],
  );
  const chosen = Math.min(at, found.length - 1);
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    box.current?.children[chosen]?.scrollIntoView({ block: "nearest" });
  }, [chosen]);
  const go = (one: Entry | undefined): void => {
    if (!one) return;
    onClose();
    if ("command" in one) one.command.act();
    else onGo(one.found);
    // Keys act on the map again, not on a field that is gone.
    document.querySelector<HTMLElement>(".map[role=application]")?.focus();
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) setAt(Math.max(0, Math.min(chosen + step, found.length - 1)));
    else if (event.key === "Enter") go(found[chosen]);
    else return;
    event.preventDefault();
  };
  return (
    <Modal opened onClose={onClose} title={t`Find or do`} yOffset="12vh">
      <TextInput
        data-autofocus
        leftSection={<IconSearch />}
        aria-label={t`Name of a place, a road user or an action`}
        placeholder={t`Such as junction 5, car-3, undo, rules`}
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
      <div ref={box} className="found" role="listbox" id={list} aria-label={t`Found`}>
        {found.map((one, n) => (
          <div
            key={"command" in one ? `do ${one.command.id}` : `${one.found.is} ${one.found.id}`}
            id={`${list}-${n}`}
            role="option"
            aria-selected={n === chosen}
            onClick={() => go(one)}
          >
            <b>{"command" in one ? one.command.label : one.found.name}</b>
            <span>{"command" in one ? one.command.keys : ofFound(one.found)}</span>
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
