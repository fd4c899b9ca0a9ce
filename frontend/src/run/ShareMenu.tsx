import { Button, Menu } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type RefObject, useEffect, useRef, useState } from "react";

import { exchange } from "../api/exchange";
import type { MapHandle } from "../map/MapCanvas";
import { tell, tellError } from "../ui/notices";
import { copyLink, record, type Recording, saveFile, savePicture, saveVector } from "../ui/share";
import { IconDown } from "../ui/icons";

/** Takes away what is seen of a run: a link, a picture, a video, paper. */
export function ShareMenu({
  run,
  handle,
  vector,
  playing,
  onPlay,
}: {
  run: string;
  handle: RefObject<Pick<MapHandle, "picture"> | null>;
  /** Of the plan, which alone can be written as a drawing; null in three dimensions. */
  vector: (() => string | null) | null;
  /** Whether the picture moves; null of a live run. */
  playing: boolean | null;
  /** Plays the recording of the run. */
  onPlay: () => void;
}) {
  const [recording, setRecording] = useState<Recording | null>(null);
  const moved = useRef(false);
  const begin = (): void => {
    const made = record((canvas) => handle.current?.picture(canvas));
    if (!made) return tell(t`This browser cannot record videos.`);
    moved.current = false;
    setRecording(made);
    if (playing === false) onPlay();
  };
  // A recording that has been played to its end ends the video.
  useEffect(() => {
    if (!recording) return;
    if (playing) moved.current = true;
    else if (playing === false && moved.current) {
      setRecording(null);
      recording.stop().then((blob) => saveFile(blob, `${run}.webm`), tellError);
    }
  }, [recording, playing, run]);
  // A view that is closed has no more pictures.
  const running = useRef<Recording | null>(null);
  running.current = recording;
  useEffect(
    () => () => {
      running.current?.stop().then((blob) => saveFile(blob, `${run}.webm`), tellError);
    },
    [run],
  );
  if (recording)
    return (
      <Button
        size="xs"
        color="red"
        onClick={() => {
          setRecording(null);
          recording.stop().then((blob) => saveFile(blob, `${run}.webm`), tellError);
        }}
      >
        <Trans>Stop and save the video</Trans>
      </Button>
    );
  return (
    <Menu position="bottom-end" withinPortal={false} withInitialFocusPlaceholder={false}>
      <Menu.Target>
        <Button size="xs" variant="default" leftSection={<IconDown size={13} />}>
          <Trans context="button">Share</Trans>
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item onClick={copyLink}>
          <Trans>Copy the link to this view</Trans>
        </Menu.Item>
        <Menu.Item
          onClick={() => {
            const canvas = handle.current?.picture();
            if (canvas) savePicture(canvas, run);
          }}
        >
          <Trans>Picture of the map (PNG)</Trans>
        </Menu.Item>
        <Menu.Item onClick={begin}>
          <Trans>Video of the map (WebM)</Trans>
        </Menu.Item>
        {playing !== null && (
          <Menu.Item component="a" href={exchange.runUrl(run, "html")} download>
            <Trans>Page with replay and report (HTML)</Trans>
          </Menu.Item>
        )}
        <Menu.Item onClick={() => print()}>
          <Trans>Print</Trans>
        </Menu.Item>
        {vector && (
          <Menu.Item
            onClick={() => {
              const svg = vector();
              if (svg) saveVector(svg, run);
            }}
          >
            <Trans>Drawing of the map (SVG)</Trans>
          </Menu.Item>
        )}
      </Menu.Dropdown>
    </Menu>
  );
}
