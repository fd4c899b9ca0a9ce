import { Alert, Button, FileButton, NativeSelect, Progress, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type DragEvent, useCallback, useRef, useState } from "react";

import { api } from "../api/client";
import { addShipped, followJob, mapImporters } from "../api/maps";
import type { Converter, Job, MapImporter } from "../api/types";
import { isXosc } from "../exchange/useImport";
import { tell } from "../ui/notices";
import { reasonOf } from "../ui/reason";
import { useLoaded } from "../ui/useLoaded";
import { stepWords } from "./steps";

interface Work {
  what: string;
  step: string;
  share: number;
  /** Files that wait for their turn. */
  waiting: number;
  /** Once the server has taken it on, what it is called there. */
  job?: string;
  cancelling?: boolean;
}

interface Refusal {
  file: string;
  reason: string;
}

/** Label of an importer, with its suffixes where it does not say them. */
const formatWords = ({ label, suffixes }: MapImporter): string =>
  suffixes.some((suffix) => label.includes(suffix)) ? label : `${label} (${suffixes.join(", ")})`;

/** Scrolls to what has just been shown. */
const intoSight = (shown: HTMLElement | null): void => shown?.scrollIntoView({ block: "nearest" });

/** Takes map files, one after another, by drop or by choice, and shows the progress of their import. */
export function AddMap({
  empty,
  onAdded,
  onReport,
}: {
  /** Whether there is no map yet. */
  empty: boolean;
  onAdded: () => void;
  onReport: (map: string) => void;
}) {
  const [over, setOver] = useState(false);
  const [converter, setConverter] = useState<Converter>(null);
  const [work, setWork] = useState<Work | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const [added, setAdded] = useState<string[]>([]);
  const { value: importers } = useLoaded(useCallback(() => mapImporters(), []));
  const others = (importers ?? []).filter(({ name }) => name !== "opendrive");
  const endings = [".xodr", ".xml", ...others.flatMap(({ suffixes }) => suffixes)];
  const queue = useRef<File[]>([]);
  const busy = useRef(false);

  const attempt = async (
    what: string,
    start: () => Promise<{ job: string }>,
    onStep: (job: Job) => void,
  ): Promise<Job | null> => {
    setWork({ what, step: t`Sending the file`, share: 0, waiting: queue.current.length });
    try {
      const { job: id } = await start();
      return await followJob(id, (job) => {
        setWork((old) => ({
          what,
          step: stepWords(job.step ?? t`preparing`),
          share: job.share ?? 0,
          waiting: queue.current.length,
          job: id,
          cancelling: old?.job === id && old.cancelling,
        }));
        onStep(job);
      });
    } catch (error) {
      setRefusals((old) => [...old, { file: what, reason: reasonOf(error) }]);
      return null;
    }
  };
  const add = async (files: readonly File[]): Promise<void> => {
    queue.current.push(...files);
    if (busy.current) return;
    busy.current = true;
    setRefusals([]);
    setAdded([]);
    for (let file = queue.current.shift(); file; file = queue.current.shift()) {
      const taken = file;
      const job = await attempt(
        taken.name,
        () => api.addMap(taken, converter),
        () => undefined,
      );
      const name = job?.result;
      if (name) {
        setAdded((old) => [...old, name]);
        onAdded();
      }
    }
    busy.current = false;
    setWork(null);
  };
  const addThose = async (): Promise<void> => {
    if (busy.current) return;
    busy.current = true;
    let last = "";
    const job = await attempt(t`The example maps`, addShipped, ({ step }) => {
      const map = step?.split(":")[0] ?? "";
      if (map !== last && last) onAdded();
      last = map;
    });
    busy.current = false;
    setWork(null);
    if (job) tell(t`The maps are ready.`);
    onAdded();
  };
  /** Cancels the job and drops the files in the queue; the job's state says when that is done. */
  const cancel = async (id: string): Promise<void> => {
    queue.current = [];
    setWork((old) => old && { ...old, waiting: 0, cancelling: true });
    // Refused only when it has ended meanwhile, which the page learns by itself.
    await api.cancelJob(id).catch(() => undefined);
  };
  const onDrop = (event: DragEvent): void => {
    event.preventDefault();
    setOver(false);
    // A scenario, perhaps with its map: the catalogue around this takes it.
    if ([...event.dataTransfer.files].some(isXosc)) return;
    event.stopPropagation();
    void add([...event.dataTransfer.files]);
  };

  return (
    <section aria-label={t`Add a map`}>
      <div
        className="drop"
        data-over={over}
        onDragOver={(event) => {
          event.preventDefault();
          setOver(true);
        }}
        onDragLeave={() => setOver(false)}
        onDrop={onDrop}
      >
        {work ? (
          <div style={{ flex: 1 }} role="status">
            <Text fw={600}>
              {work.what}
              {work.waiting > 0 && t`, then ${work.waiting} more`}
            </Text>
            <Text size="sm" c="dimmed">
              {work.step} …
            </Text>
            <div style={{ display: "flex", gap: 10, alignItems: "center", marginTop: 8 }}>
              <Progress
                value={Math.max(4, work.share * 100)}
                animated
                aria-label={t`Import progress`}
                style={{ flex: 1 }}
              />
              <Button
                size="compact-sm"
                variant="default"
                disabled={!work.job || work.cancelling}
                onClick={() => work.job && void cancel(work.job)}
              >
                {work.cancelling ? t`Cancelling` : t`Cancel`}
              </Button>
            </div>
          </div>
        ) : (
          <>
            <div>
              <Text fw={600}>{empty ? t`No maps yet` : t`Add a map of your own`}</Text>
              <Text size="sm" c="dimmed">
                {empty
                  ? t`Begin with the example maps, or drop an OpenDRIVE file (.xodr) of your own here.`
                  : t`Drop one or more OpenDRIVE files (.xodr) here, or choose them.`}
              </Text>
              {others.length > 0 && (
                <Text size="sm" c="dimmed">
                  <Trans>Also taken: {others.map(formatWords).join("; ")}</Trans>
                </Text>
              )}
            </div>
            <div style={{ display: "flex", gap: 10, flexWrap: "wrap", alignItems: "flex-end" }}>
              <NativeSelect
                label={t`SUMO network by`}
                size="xs"
                value={converter ?? "odscen"}
                onChange={({ currentTarget }) =>
                  setConverter(currentTarget.value === "netconvert" ? "netconvert" : null)
                }
                data={["odscen", "netconvert"]}
              />
              <Button variant={empty ? "filled" : "default"} onClick={() => void addThose()}>
                <Trans>Add the example maps</Trans>
              </Button>
              <FileButton multiple accept={endings.join(",")} onChange={(files) => void add(files)}>
                {(props) => (
                  <Button variant="default" {...props}>
                    <Trans>Choose a file</Trans>
                  </Button>
                )}
              </FileButton>
            </div>
          </>
        )}
      </div>
      {added.map((name) => (
        <Alert key={name} color="blue" mt="sm" role="status" title={t`${name} is ready`}>
          <Button size="compact-sm" variant="default" onClick={() => onReport(name)}>
            <Trans>Import report of {name}</Trans>
          </Button>
        </Alert>
      ))}
      {refusals.map(({ file, reason }, n) => (
        <Alert
          key={n}
          ref={intoSight}
          color="red"
          mt="sm"
          title={t`${file} could not be added`}
          withCloseButton
          closeButtonLabel={t`Close this message`}
          onClose={() => setRefusals((old) => old.filter((_, k) => k !== n))}
          style={{ overflowWrap: "anywhere" }}
        >
          <span>
            <Trans>
              Nothing was changed. If it is an OpenDRIVE map (.xodr), it is damaged or says something that
              odscen does not know: export it again, or pass the message below to who made it.
            </Trans>
          </span>
          <details className="words">
            <summary>
              <Trans>What is wrong with it</Trans>
            </summary>
            <pre tabIndex={0}>{reason}</pre>
          </details>
        </Alert>
      ))}
    </section>
  );
}
