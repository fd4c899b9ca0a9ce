import { ActionIcon, Button, Menu, Tooltip } from "@mantine/core";
import { memo, useEffect, useRef, useState } from "react";
import { createPortal } from "react-dom";

import { api } from "../api/client";
import { exchange } from "../api/exchange";
import { isXosc } from "../exchange/useImport";
import { IconHelp, IconMenu, IconRedo, IconSearch, IconTour, IconUndo } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { go } from "../ui/address";
import { ExportMenu } from "./ExportMenu";
import { NameDialog, OpenDialog } from "./fileDialogs";
import type { EditorStore } from "./store";

const SAVED = { saved: "All changes saved", saving: "Saving …", failed: "Not saved" } as const;
const named = (label: unknown): string => (typeof label === "string" && label ? `: ${label}` : "");

type Dialog = "rename" | "copy" | "open" | null;

/** Undo, redo, autosave and files, in the head of the page. */
export const HeadTools = memo(function HeadTools({
  store,
  onFind,
  onHelp,
  onTour,
  onPicture,
  onVector,
}: {
  store: EditorStore;
  onFind: () => void;
  onHelp: () => void;
  onTour: () => void;
  /** What the map shows now. */
  onPicture: () => HTMLCanvasElement | null;
  onVector: () => string | null;
}) {
  const { scenario, checked, saving, undo, redo, name, edit } = store();
  const [slot, setSlot] = useState<HTMLElement | null>(null);
  const [dialog, setDialog] = useState<Dialog>(null);
  const [imported, setImported] = useState(false);
  const file = useRef<HTMLInputElement>(null);
  useEffect(() => setSlot(document.getElementById("head-slot")), []);
  if (!slot || !scenario) return null;
  const close = (): void => setDialog(null);
  const tools = [
    { word: "Undo", keys: "Ctrl+Z", label: scenario.undo, act: undo, icon: <IconUndo /> },
    { word: "Redo", keys: "Ctrl+Y", label: scenario.redo, act: redo, icon: <IconRedo /> },
  ];
  const upload = (chosen: File | undefined): void => {
    if (!chosen) return;
    if (!isXosc(chosen)) {
      api.uploadScenario(chosen).then((made) => go({ view: "editor", scenario: made.name }), tellError);
      return;
    }
    tell(`Importing ${chosen.name} …`);
    exchange
      .bring([chosen], () => undefined)
      .then((made) => made !== null && go({ view: "imported", scenario: made }), tellError);
  };
  /** Whether there is a report is asked for when it could be chosen. */
  const askForReport = (): void => {
    exchange.report(name).then(
      () => setImported(true),
      () => setImported(false),
    );
  };
  return createPortal(
    <>
      <span className="saving" role="status" data-checked={checked === scenario?.document}>
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
      <Tooltip label="Find a road, a junction or a road user (Ctrl+K)">
        <ActionIcon
          variant="default"
          size="lg"
          aria-label="Find a road, a junction or a road user"
          onClick={onFind}
        >
          <IconSearch />
        </ActionIcon>
      </Tooltip>
      <Menu
        position="bottom-end"
        withinPortal={false}
        withInitialFocusPlaceholder={false}
        onOpen={askForReport}
      >
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
          {imported && (
            <Menu.Item onClick={() => go({ view: "imported", scenario: name })}>
              Report of the import
            </Menu.Item>
          )}
        </Menu.Dropdown>
      </Menu>
      <ExportMenu name={name} onPicture={onPicture} onVector={onVector} />
      <input
        ref={file}
        type="file"
        accept=".json,.graphml,.xml,.xosc"
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
});
