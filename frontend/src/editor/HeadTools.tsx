import { ActionIcon, Button, Menu, Tooltip } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import { createPortal } from "react-dom";

import { api } from "../api/client";
import { IconDown, IconHelp, IconMenu, IconRedo, IconTour, IconUndo } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { go } from "../ui/address";
import { NameDialog, OpenDialog } from "./fileDialogs";
import type { EditorStore } from "./store";

const SAVED = { saved: "All changes saved", saving: "Saving …", failed: "Not saved" } as const;
const named = (label: unknown): string => (typeof label === "string" && label ? `: ${label}` : "");

type Dialog = "rename" | "copy" | "open" | null;

/** Undo, redo, autosave and files, in the head of the page. */
export function HeadTools({
  store,
  onHelp,
  onTour,
}: {
  store: EditorStore;
  onHelp: () => void;
  onTour: () => void;
}) {
  const { scenario, saving, undo, redo, name, edit } = store();
  const [slot, setSlot] = useState<HTMLElement | null>(null);
  const [dialog, setDialog] = useState<Dialog>(null);
  const file = useRef<HTMLInputElement>(null);
  useEffect(() => setSlot(document.getElementById("head-slot")), []);
  if (!slot || !scenario) return null;
  const close = (): void => setDialog(null);
  const tools = [
    { word: "Undo", keys: "Ctrl+Z", label: scenario.undo, act: undo, icon: <IconUndo /> },
    { word: "Redo", keys: "Ctrl+Y", label: scenario.redo, act: redo, icon: <IconRedo /> },
  ];
  const upload = (chosen: File | undefined): void => {
    if (chosen)
      api.uploadScenario(chosen).then((made) => go({ view: "editor", scenario: made.name }), tellError);
  };
  return createPortal(
    <>
      <span className="saving" role="status">
        {SAVED[saving]}
      </span>
      {tools.map(({ word, keys, label, act, icon }) => (
        <Tooltip key={word} label={`${word}${named(label)} (${keys})`}>
          <ActionIcon
            variant="default"
            size="lg"
            aria-label={`${word}${named(label)}`}
            disabled={!label}
            onClick={() => void act()}
          >
            {icon}
          </ActionIcon>
        </Tooltip>
      ))}
      <Menu position="bottom-end" withinPortal={false} withInitialFocusPlaceholder={false}>
        <Menu.Target>
          <Button variant="default" leftSection={<IconMenu />}>
            Scenario
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Item onClick={() => setDialog("rename")}>Rename …</Menu.Item>
          <Menu.Item onClick={() => setDialog("copy")}>Save as …</Menu.Item>
          <Menu.Item onClick={() => setDialog("open")}>Open another …</Menu.Item>
          <Menu.Item onClick={() => file.current?.click()}>Upload a file …</Menu.Item>
          <Menu.Item onClick={() => go({ view: "runs", scenario: name })}>Earlier runs</Menu.Item>
          <Menu.Divider />
          <Menu.Item
            leftSection={<IconDown size={15} />}
            component="a"
            href={api.downloadUrl(name, "json")}
            download
          >
            Download as a document (JSON)
          </Menu.Item>
          <Menu.Item
            leftSection={<IconDown size={15} />}
            component="a"
            href={api.downloadUrl(name, "graphml")}
            download
          >
            Download as a graph (GraphML)
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <input
        ref={file}
        type="file"
        accept=".json,.graphml,.xml"
        hidden
        aria-label="Scenario file to upload"
        onChange={(event) => {
          upload(event.currentTarget.files?.[0]);
          event.currentTarget.value = "";
        }}
      />
      <Tooltip label="Short tour">
        <ActionIcon variant="subtle" color="gray" size="lg" aria-label="Short tour" onClick={onTour}>
          <IconTour />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="Help: keyboard shortcuts and glossary (?)">
        <ActionIcon
          variant="subtle"
          color="gray"
          size="lg"
          aria-label="Help: keyboard shortcuts and glossary"
          onClick={onHelp}
        >
          <IconHelp />
        </ActionIcon>
      </Tooltip>
      {dialog === "rename" && (
        <NameDialog
          title="Rename the scenario"
          label="Name"
          value={scenario.document.name}
          action="Rename"
          onClose={close}
          onName={async (title) => {
            if (await edit({ kind: "rename", name: title })) close();
          }}
        />
      )}
      {dialog === "copy" && (
        <NameDialog
          title="Save under another name"
          label="Name of the copy"
          value={`${name}-copy`}
          action="Save"
          onClose={close}
          onName={async (to) => {
            const made = await api.copyScenario(name, to);
            close();
            tell(`“${name}” stays as it is. You now work on the copy “${made.name}”.`);
            go({ view: "editor", scenario: made.name });
          }}
        />
      )}
      {dialog === "open" && <OpenDialog current={name} onClose={close} />}
    </>,
    slot,
  );
}
