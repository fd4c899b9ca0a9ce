import { ActionIcon, Button, Menu, Tooltip } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useLingui } from "@lingui/react";
import { Trans } from "@lingui/react/macro";
import { memo, useEffect, useRef, useState } from "react";
import { createPortal } from "react-dom";

import { localized } from "../language/localized";
import { api } from "../api/client";
import { exchange } from "../api/exchange";
import { isXosc } from "../exchange/useImport";
import { IconHelp, IconMenu, IconPlay, IconRedo, IconSearch, IconTour, IconUndo } from "../ui/icons";
import { tell, tellError } from "../ui/notices";
import { go } from "../ui/address";
import { CompareDialog } from "./CompareDialog";
import { ExportMenu } from "./ExportMenu";
import { NameDialog, OpenDialog } from "./fileDialogs";
import type { EditorStore } from "./store";
import { served } from "../language/served";

const SAVED = localized(
  () => ({ saved: t`All changes saved`, saving: t`Saving …`, failed: t`Not saved` }) as const,
);
const named = (label: unknown): string => (typeof label === "string" && label ? `: ${label}` : "");

type Dialog = "rename" | "copy" | "open" | "compare" | null;

/** Undo, redo, autosave and files, in the head of the page. */
export const HeadTools = memo(function HeadTools({
  store,
  starting,
  onRun,
  onFind,
  onHelp,
  onTour,
  onPicture,
  onVector,
}: {
  store: EditorStore;
  /** Whether a run is being started. */
  starting: boolean;
  onRun: () => void;
  onFind: () => void;
  onHelp: () => void;
  onTour: () => void;
  /** What the map shows now. */
  onPicture: () => HTMLCanvasElement | null;
  onVector: () => string | null;
}) {
  // Drawn anew with another language.
  useLingui();
  const { scenario, checked, saving, undo, redo, name, edit } = store();
  const [slot, setSlot] = useState<HTMLElement | null>(null);
  const [dialog, setDialog] = useState<Dialog>(null);
  const [imported, setImported] = useState(false);
  const file = useRef<HTMLInputElement>(null);
  useEffect(() => setSlot(document.getElementById("head-slot")), []);
  if (!slot || !scenario) return null;
  const close = (): void => setDialog(null);
  const tools = [
    {
      word: t`Undo`,
      keys: t`Ctrl+Z`,
      label: scenario.undo && served(scenario.undo),
      act: undo,
      icon: <IconUndo />,
    },
    {
      word: t`Redo`,
      keys: t`Ctrl+Y`,
      label: scenario.redo && served(scenario.redo),
      act: redo,
      icon: <IconRedo />,
    },
  ];
  const upload = (chosen: File | undefined): void => {
    if (!chosen) return;
    if (!isXosc(chosen)) {
      api.uploadScenario(chosen).then((made) => go({ view: "editor", scenario: made.name }), tellError);
      return;
    }
    tell(t`Importing ${chosen.name} …`);
    exchange
      .bring("openscenario", [chosen], () => undefined)
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
      <span
        className="saving"
        role="status"
        data-checked={checked === scenario?.document}
        data-state={saving}
      >
        {SAVED()[saving]}
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
      <Tooltip label={t`Find a place or a road user, or do anything (Ctrl+K)`}>
        <ActionIcon variant="default" size="lg" aria-label={t`Find or do`} onClick={onFind}>
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
          <Button variant="default" leftSection={<IconMenu />} aria-label={t`Scenario`}>
            <span className="wide-word">
              <Trans>Scenario</Trans>
            </span>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Item onClick={() => setDialog("rename")}>
            <Trans>Rename …</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => setDialog("copy")}>
            <Trans>Save as …</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => setDialog("open")}>
            <Trans>Open another …</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => file.current?.click()}>
            <Trans>Upload a file …</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => setDialog("compare")}>
            <Trans>Compare with …</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => go({ view: "runs", scenario: name })}>
            <Trans>Earlier runs</Trans>
          </Menu.Item>
          {imported && (
            <Menu.Item onClick={() => go({ view: "imported", scenario: name })}>
              <Trans>Report of the import</Trans>
            </Menu.Item>
          )}
        </Menu.Dropdown>
      </Menu>
      <ExportMenu name={name} onPicture={onPicture} onVector={onVector} />
      <Tooltip label={t`Run the scenario (Ctrl+Enter)`}>
        <Button leftSection={<IconPlay />} loading={starting} onClick={onRun}>
          <Trans context="button">Run</Trans>
        </Button>
      </Tooltip>
      <input
        ref={file}
        type="file"
        accept=".json,.graphml,.xml,.xosc"
        hidden
        aria-label={t`Scenario file to upload`}
        onChange={(event) => {
          upload(event.currentTarget.files?.[0]);
          event.currentTarget.value = "";
        }}
      />
      <Tooltip label={t`Short tour`}>
        <ActionIcon variant="subtle" color="gray" size="lg" aria-label={t`Short tour`} onClick={onTour}>
          <IconTour />
        </ActionIcon>
      </Tooltip>
      <Tooltip label={t`Help: keyboard shortcuts and glossary (?)`}>
        <ActionIcon
          variant="subtle"
          color="gray"
          size="lg"
          aria-label={t`Help: keyboard shortcuts and glossary`}
          onClick={onHelp}
        >
          <IconHelp />
        </ActionIcon>
      </Tooltip>
      {dialog === "rename" && (
        <NameDialog
          title={t`Rename the scenario`}
          label={t`Name`}
          value={scenario.document.name}
          action={t`Rename`}
          onClose={close}
          onName={async (title) => {
            if (await edit({ kind: "rename", name: title })) close();
          }}
        />
      )}
      {dialog === "copy" && (
        <NameDialog
          title={t`Save under another name`}
          label={t`Name of the copy`}
          value={`${name}-copy`}
          action={t`Save`}
          onClose={close}
          onName={async (to) => {
            const made = await api.copyScenario(name, to);
            close();
            tell(t`“${name}” stays as it is. You now work on the copy “${made.name}”.`);
            go({ view: "editor", scenario: made.name });
          }}
        />
      )}
      {dialog === "compare" && <CompareDialog scenario={name} onClose={close} />}
      {dialog === "open" && <OpenDialog current={name} onClose={close} />}
    </>,
    slot,
  );
});
