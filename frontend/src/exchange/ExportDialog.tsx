import { i18n } from "@lingui/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import "./exchange.css";

import { Alert, Button, Group, Loader, Modal, Select, Text, Title } from "@mantine/core";
import { useCallback, useState } from "react";

import { ApiError } from "../api/client";
import { exchange, type ExportNote, type ExportNotes, type Format } from "../api/exchange";
import { IconDown } from "../ui/icons";
import { useLoaded } from "../ui/useLoaded";
import { sentence } from "../ui/words";
import { VERSIONS, wordsOf } from "./formats";
import { served } from "../language/served";

/** Notes that are shown at once. */
const SHOWN = 200;

/** Says what a format cannot before the files are downloaded. */
export function ExportDialog({
  name,
  format,
  onClose,
}: {
  name: string;
  format: Format;
  onClose: () => void;
}) {
  const [version, setVersion] = useState<string | null>(
    format.options.find((option) => option.name === "version")?.default ?? null,
  );
  return (
    <Modal opened onClose={onClose} size="lg" title={t`Export to ${format.title}`}>
      <Text size="sm" mb="sm">
        {wordsOf(format)}
      </Text>
      {version !== null && (
        <Select
          label={t`Version`}
          data={VERSIONS()}
          value={version}
          allowDeselect={false}
          onChange={(chosen) => setVersion(chosen ?? version)}
          comboboxProps={{ withinPortal: false }}
          mb="md"
        />
      )}
      <Body key={version} name={name} format={format.id} version={version} />
    </Modal>
  );
}

function Body({ name, format, version }: { name: string; format: string; version: string | null }) {
  const [problems, setProblems] = useState<readonly string[]>([]);
  const load = useCallback(
    () =>
      exchange.notes(name, format, version).catch((error: unknown) => {
        if (error instanceof ApiError) setProblems((error.body.problems ?? []).map(served));
        throw error;
      }),
    [name, format, version],
  );
  const { value, error } = useLoaded(load);
  if (error !== null)
    return (
      <Alert color="red" title={t`It cannot be exported as it is`}>
        <Text size="sm">{error}</Text>
        <ul style={{ margin: "6px 0 0", paddingLeft: 20 }}>
          {problems.map((one) => (
            <li key={one}>{one}</li>
          ))}
        </ul>
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Preparing the export`} />;
  return (
    <>
      <Notes notes={value} format={format} />
      <Group justify="space-between" mt="md" wrap="nowrap">
        <Text size="sm" c="dimmed" style={{ overflowWrap: "anywhere" }}>
          {plural(value.files.length, { one: "# file", other: "# files" })}: {value.files.join(", ")}
        </Text>
        <Button
          component="a"
          href={exchange.exportUrl(name, format, version)}
          download
          leftSection={<IconDown size={15} />}
          style={{ flexShrink: 0 }}
        >
          <Trans>Download (ZIP)</Trans>
        </Button>
      </Group>
    </>
  );
}

function Notes({
  notes: { approximated, left_out: leftOut },
  format,
}: {
  notes: ExportNotes;
  format: string;
}) {
  if (format !== "openscenario") return null;
  if (approximated.length + leftOut.length === 0)
    return (
      <Text size="sm">
        <Trans>All of the scenario can be said in OpenSCENARIO.</Trans>
      </Text>
    );
  return (
    <>
      <List title={t`Not exported`} notes={leftOut} />
      <List title={t`Exported approximately`} notes={approximated} />
      <Text size="xs" c="dimmed">
        <Trans>The same list is in the download.</Trans>
      </Text>
    </>
  );
}

function List({ title, notes }: { title: string; notes: readonly ExportNote[] }) {
  if (notes.length === 0) return null;
  const reasons = new Map<string, string[]>();
  for (const { place, reason } of notes) reasons.set(reason, [...(reasons.get(reason) ?? []), place]);
  return (
    <section aria-label={title}>
      <Title order={3} size="h6" mt="sm">
        {title}: {notes.length.toLocaleString(i18n.locale)}
      </Title>
      <ul className="import-reasons" style={{ maxHeight: 260, overflow: "auto" }} tabIndex={0}>
        {[...reasons].slice(0, SHOWN).map(([reason, places]) => (
          <li key={reason}>
            <Text size="sm">{sentence(served(reason))}</Text>
            <Text size="xs" c="dimmed">
              {places.slice(0, 12).join(", ")}
              {places.length > 12 && t` and ${places.length - 12} more`}
            </Text>
          </li>
        ))}
      </ul>
    </section>
  );
}
