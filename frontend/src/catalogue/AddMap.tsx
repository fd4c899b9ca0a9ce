import { Button, FileButton, Progress, Text } from "@mantine/core";
import { type DragEvent, useState } from "react";

import { api } from "../api/client";
import type { Job } from "../api/types";
import { tell, tellError } from "../ui/notices";

const PAUSE = 300;
const pause = (): Promise<void> => new Promise((done) => setTimeout(done, PAUSE));

const reason = (job: Job): string =>
  (typeof job.error === "string" ? job.error : job.error?.message) ?? "The map could not be read.";

/** Takes a map file by drop or by choice, and shows how far its preparation is. */
export function AddMap({ onAdded }: { onAdded: () => void }) {
  const [over, setOver] = useState(false);
  const [work, setWork] = useState<{ file: string; step: string; share: number } | null>(null);

  const add = async (file: File): Promise<void> => {
    setWork({ file: file.name, step: "Sending the file", share: 0 });
    try {
      const { job: id } = await api.addMap(file);
      for (;;) {
        const job = await api.job(id);
        if (job.state === "done") break;
        if (job.state === "failed") throw new Error(reason(job));
        setWork({ file: file.name, step: job.step ?? "Preparing", share: job.share ?? 0 });
        await pause();
      }
      tell(`${file.name} is ready.`);
      onAdded();
    } catch (error) {
      tellError(error);
    } finally {
      setWork(null);
    }
  };

  const onDrop = (event: DragEvent): void => {
    event.preventDefault();
    setOver(false);
    void (async () => {
      for (const file of event.dataTransfer.files) await add(file);
    })();
  };

  return (
    <section
      className="drop"
      data-over={over}
      aria-label="Add a map"
      onDragOver={(event) => { event.preventDefault(); setOver(true); }}
      onDragLeave={() => setOver(false)}
      onDrop={onDrop}
    >
      {work ? (
        <div style={{ flex: 1 }} role="status">
          <Text fw={600}>{work.file}</Text>
          <Text size="sm" c="dimmed">{work.step} …</Text>
          <Progress value={Math.max(4, work.share * 100)} animated mt={8} aria-label="How far the map is prepared" />
        </div>
      ) : (
        <>
          <div>
            <Text fw={600}>Add a map of your own</Text>
            <Text size="sm" c="dimmed">Drop an OpenDRIVE file (.xodr) here, or choose one.</Text>
          </div>
          <FileButton accept=".xodr,.xml" onChange={(file) => { if (file) void add(file); }}>
            {(props) => <Button variant="default" {...props}>Choose a file</Button>}
          </FileButton>
        </>
      )}
    </section>
  );
}
