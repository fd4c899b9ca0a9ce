import { Alert, Anchor, Button, Group, Loader, Select, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback, useState } from "react";

import { exchange } from "../api/exchange";
import { runs } from "../api/runs";
import { VERSIONS } from "../exchange/formats";
import { useLoaded } from "../ui/useLoaded";
import { bytes } from "../ui/words";
import { fileGroups } from "./files";

/** Everything that a run has left, to be downloaded; looked up when it is opened. */
export function Files({ run }: { run: string }) {
  const [open, setOpen] = useState(false);
  return (
    <details
      className="words"
      style={{ marginTop: 18 }}
      onToggle={(event) => setOpen(event.currentTarget.open)}
    >
      <summary>
        <Trans>Download the results</Trans>
      </summary>
      {open && <Listed run={run} />}
    </details>
  );
}

function Listed({ run }: { run: string }) {
  const { value, error } = useLoaded(useCallback(() => runs.files(run), [run]));
  if (error)
    return (
      <Alert color="gray" title={t`There are no files of this run`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Loading the list of files`} />;
  const recorded = value.some(({ name }) => name === "trajectories.parquet");
  return (
    <>
      {recorded && <AsRun run={run} />}
      <Groups run={run} files={value} />
    </>
  );
}

/** What happened, for players of OpenSCENARIO. */
function AsRun({ run }: { run: string }) {
  const [version, setVersion] = useState("1.2");
  return (
    <div>
      <Text fw={600} size="sm" mt="sm">
        <Trans>OpenSCENARIO, as it happened</Trans>
      </Text>
      <Text size="xs" c="dimmed" mb={6}>
        <Trans>
          Each road user follows the trajectory that it had, and signals change as they did; nothing reacts.
        </Trans>
      </Text>
      <Group gap="sm" align="end">
        <Select
          size="xs"
          label={t`Version`}
          data={VERSIONS()}
          value={version}
          allowDeselect={false}
          onChange={(chosen) => setVersion(chosen ?? version)}
        />
        <Button
          size="xs"
          component="a"
          variant="default"
          href={exchange.runUrl(run, "openscenario", version)}
          download
        >
          <Trans>Download (ZIP)</Trans>
        </Button>
      </Group>
    </div>
  );
}

function Groups({ run, files: all }: { run: string; files: Parameters<typeof fileGroups>[0] }) {
  return fileGroups(all).map(({ title, text, files }) => (
    <div key={title}>
      <Text fw={600} size="sm" mt="sm">
        {title}
      </Text>
      <Text size="xs" c="dimmed">
        {text}
      </Text>
      <ul className="files" aria-label={title}>
        {files.map(({ name, size, word }) => (
          <li key={name}>
            <Anchor underline="always" size="sm" href={runs.fileUrl(run, name)} download>
              {word}
            </Anchor>
            <span>{bytes(size)}</span>
          </li>
        ))}
      </ul>
    </div>
  ));
}
