import { Alert, Anchor, Loader, Text, Title } from "@mantine/core";
import { useCallback } from "react";

import { runs } from "../api/runs";
import { useLoaded } from "../ui/useLoaded";
import { bytes } from "../ui/words";
import { fileGroups } from "./files";

/** Everything that a run has left, to be downloaded. */
export function Files({ run }: { run: string }) {
  const { value, error } = useLoaded(useCallback(() => runs.files(run), [run]));
  if (error) return <Alert color="gray" title="There are no files of this run">{error}</Alert>;
  if (!value) return <Loader aria-label="Loading the list of files" />;
  return (
    <>
      {fileGroups(value).map(({ title, text, files }) => (
        <section key={title} style={{ marginBottom: 18 }}>
          <Title order={3} size="h5">{title}</Title>
          <Text size="sm" c="dimmed">{text}</Text>
          <ul className="files" aria-label={title}>
            {files.map(({ name, size, word }) => (
              <li key={name}><Anchor underline="always" size="sm" href={runs.fileUrl(run, name)} download>{word}</Anchor><span>{bytes(size)}</span></li>
            ))}
          </ul>
        </section>
      ))}
    </>
  );
}
