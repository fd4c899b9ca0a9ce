import { Alert, Button, FileButton, Group, Text, TextInput, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type KeyboardEvent, useEffect, useMemo, useRef, useState } from "react";

import { removeBackground, setBackground } from "../api/maps";
import type { Scene } from "../map/scene";
import { takeUnderlay, useUnderlay } from "../map/underlay";
import { tellError } from "../ui/notices";

/** While a picture is placed, what clicks on the map are for, and what is shown there. */
export interface Placing {
  onMap: (x: number, y: number) => void;
  pins: Scene["pins"];
}

/** A place in the picture, pixels, and on the map, metres, once it was chosen there. */
interface Pair {
  column: number;
  row: number;
  on: { x: number; y: number } | null;
}

const WORLD = /\.(wld|[a-z]{2,4}w)$/i;
const TIFF = /\.tiff?$/i;

/** The picture under a map: chosen, placed by its files or by two points, and taken away. */
export function PictureForm({
  map,
  onPlacing,
}: {
  map: string;
  onPlacing: (placing: Placing | null) => void;
}) {
  const there = useUnderlay(map);
  const [crs, setCrs] = useState("");
  const [busy, setBusy] = useState(false);
  const [file, setFile] = useState<File | null>(null);
  const send = async (given: { file: File; world: File | null; points: string | null }): Promise<void> => {
    setBusy(true);
    try {
      await takeUnderlay(map, await setBackground(map, { ...given, crs: crs.trim() || null }));
      setFile(null);
    } catch (error) {
      tellError(error);
    } finally {
      setBusy(false);
    }
  };
  const choose = (files: File[]): void => {
    const world = files.find(({ name }) => WORLD.test(name)) ?? null;
    const picture = files.find((one) => one !== world);
    if (!picture) return;
    // What its files do not place is placed by hand.
    if (world || TIFF.test(picture.name)) void send({ file: picture, world, points: null });
    else setFile(picture);
  };
  const remove = async (): Promise<void> => {
    setBusy(true);
    try {
      await removeBackground(map);
      await takeUnderlay(map, null);
    } catch (error) {
      tellError(error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <section aria-label={t`Picture under the map`}>
      <Title order={2} size="h5" mt="lg">
        <Trans>Picture under the map</Trans>
      </Title>
      <Text size="sm" c="dimmed" mb={6}>
        {there ? (
          <Trans>
            {there.source} lies under the map; how much the roads hide of it is set in the layers.
          </Trans>
        ) : (
          <Trans>
            An aerial photograph or a plan: PNG, JPEG or GeoTIFF, with its world file if it has one.
          </Trans>
        )}
      </Text>
      {file ? (
        <PointPairs
          file={file}
          busy={busy}
          onPlacing={onPlacing}
          onCancel={() => setFile(null)}
          onDone={(points) => void send({ file, world: null, points })}
        />
      ) : (
        <>
          <Group gap={6} mb={6}>
            <FileButton
              multiple
              accept="image/png,image/jpeg,image/tiff,.wld,.pgw,.pngw,.jgw,.jpgw,.jpegw,.tfw,.tifw"
              inputProps={{ "aria-label": t`Picture and world file` }}
              onChange={choose}
            >
              {(props) => (
                <Button {...props} size="compact-sm" variant="default" loading={busy}>
                  {there ? <Trans>Another picture …</Trans> : <Trans>Choose a picture …</Trans>}
                </Button>
              )}
            </FileButton>
            {there && (
              <Button size="compact-sm" variant="default" disabled={busy} onClick={() => void remove()}>
                <Trans>Remove the picture</Trans>
              </Button>
            )}
          </Group>
          <TextInput
            size="xs"
            label={t`Coordinate system of the world file`}
            description={t`Empty: metres of the map`}
            placeholder={t`EPSG:25832`}
            value={crs}
            onChange={({ currentTarget: { value } }) => setCrs(value)}
          />
        </>
      )}
    </section>
  );
}

/** Two places are chosen, each in the picture first and then on the map. */
function PointPairs({
  file,
  busy,
  onPlacing,
  onCancel,
  onDone,
}: {
  file: File;
  busy: boolean;
  onPlacing: (placing: Placing | null) => void;
  onCancel: () => void;
  onDone: (points: string) => void;
}) {
  const url = useMemo(() => URL.createObjectURL(file), [file]);
  useEffect(() => () => URL.revokeObjectURL(url), [url]);
  const [pairs, setPairs] = useState<readonly Pair[]>([]);
  const open = pairs.at(-1);
  const waits = open !== undefined && open.on === null;
  const whole = pairs.filter(({ on }) => on !== null);
  useEffect(() => {
    onPlacing({
      onMap: (x, y) =>
        setPairs((all) =>
          all.map((one, n) => (n === all.length - 1 && !one.on ? { ...one, on: { x, y } } : one)),
        ),
      pins: whole.map(({ on }, n) => ({ x: on?.x ?? 0, y: on?.y ?? 0, sign: String(n + 1), text: "" })),
    });
    // The pins follow from the pairs alone.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [pairs, onPlacing]);
  useEffect(() => () => onPlacing(null), [onPlacing]);
  const add = (column: number, row: number): void =>
    setPairs((all) => [...all.filter(({ on }) => on !== null), { column, row, on: null }]);
  const next = whole.length + 1;
  return (
    <>
      <Alert mb="sm" role="status">
        {whole.length >= 2 ? (
          <Trans>Two places are known: the picture can be placed.</Trans>
        ) : waits ? (
          <Trans>Now choose the same place on the map (place {next} of 2).</Trans>
        ) : (
          <Trans>Choose a place in the picture (place {next} of 2).</Trans>
        )}
      </Alert>
      <Picture url={url} pairs={pairs} onPlace={add} />
      <Group gap={6} mt={6}>
        <Button
          size="compact-sm"
          loading={busy}
          disabled={whole.length < 2}
          onClick={() =>
            onDone(JSON.stringify(whole.map(({ column, row, on }) => [column, row, on?.x, on?.y])))
          }
        >
          <Trans>Place the picture</Trans>
        </Button>
        <Button
          size="compact-sm"
          variant="default"
          disabled={pairs.length === 0}
          onClick={() => setPairs([])}
        >
          <Trans>Begin again</Trans>
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onCancel}>
          <Trans>Cancel</Trans>
        </Button>
      </Group>
    </>
  );
}

/** The picture to choose places in: by mouse, or by arrow keys and Enter. */
function Picture({
  url,
  pairs,
  onPlace,
}: {
  url: string;
  pairs: readonly Pair[];
  onPlace: (column: number, row: number) => void;
}) {
  const image = useRef<HTMLImageElement>(null);
  const [zoom, setZoom] = useState(1);
  const [size, setSize] = useState({ width: 1, height: 1 });
  // Where the keys are, as shares of the picture.
  const [cross, setCross] = useState<{ u: number; v: number } | null>(null);
  const place = (u: number, v: number): void => onPlace(u * size.width, v * size.height);
  const onKeyDown = (event: KeyboardEvent): void => {
    const step = (event.shiftKey ? 0.05 : 0.01) / zoom;
    const moves: Record<string, [number, number]> = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, -step],
      ArrowDown: [0, step],
    };
    const at = cross ?? { u: 0.5, v: 0.5 };
    const move = moves[event.key];
    const within = (share: number): number => Math.min(Math.max(share, 0), 1);
    if (move) setCross({ u: within(at.u + move[0]), v: within(at.v + move[1]) });
    else if (event.key === "Enter") place(at.u, at.v);
    else return;
    event.preventDefault();
  };
  const marks = [
    ...pairs.map(({ column, row }, n) => ({
      u: column / size.width,
      v: row / size.height,
      text: String(n + 1),
    })),
    ...(cross ? [{ ...cross, text: "+" }] : []),
  ];
  return (
    <>
      <div className="picture-box">
        <div
          className="picture"
          style={{ width: `${zoom * 100}%` }}
          role="application"
          tabIndex={0}
          aria-label={t`Picture. Arrow keys move, Enter chooses the place.`}
          onKeyDown={onKeyDown}
          onBlur={() => setCross(null)}
          onClick={(event) => {
            const box = image.current?.getBoundingClientRect();
            if (box && box.width > 0)
              place((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
          }}
        >
          <img
            ref={image}
            src={url}
            alt=""
            draggable={false}
            onLoad={({ currentTarget: { naturalWidth, naturalHeight } }) =>
              setSize({ width: naturalWidth, height: naturalHeight })
            }
          />
          {marks.map(({ u, v, text }, n) => (
            <span key={n} className="picture-mark" style={{ left: `${u * 100}%`, top: `${v * 100}%` }}>
              {text}
            </span>
          ))}
        </div>
      </div>
      <Group gap={6} mt={6}>
        <Button size="compact-sm" variant="default" disabled={zoom >= 16} onClick={() => setZoom(zoom * 2)}>
          <Trans>Picture larger</Trans>
        </Button>
        <Button size="compact-sm" variant="default" disabled={zoom <= 1} onClick={() => setZoom(zoom / 2)}>
          <Trans>Picture smaller</Trans>
        </Button>
      </Group>
    </>
  );
}
