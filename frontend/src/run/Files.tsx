import { Alert, Anchor, Loader, Text } from "@mantine/core";
import { useCallback, useState } from "react";

import { runs } from "../api/runs";
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
      <summary>Download the results</summary>
      {open && <Listed run={run} />}
    </details>
  );
}

function Listed({ run }: { run: string }) {
  const { value, error } = useLoaded(useCallback(() => runs.files(run), [run]));
  if (error)
    return (
      <Alert color="gray" title="There are no files of this run">
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label="Loading the list of files" />;
  return fileGroups(value).map(({ title, text, files }) => (
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
