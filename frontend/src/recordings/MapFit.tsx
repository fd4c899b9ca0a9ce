import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Alert, Button, Group, Loader, Modal, Select, Text } from "@mantine/core";
import { memo, useCallback, useState } from "react";

import { api } from "../api/client";
import { type MapAgreement, recordings, type RecordingInfo } from "../api/recordings";
import { served } from "../language/served";
import { fixed } from "../language/numbers";
import { lengthText } from "../language/units";
import { reasonOf } from "../ui/reason";
import { useLoaded } from "../ui/useLoaded";
import { sentence } from "../ui/words";

const percent = (share: number): string => `${fixed(100 * share, 1)} %`;

/** Below this share on lanes, map and recording hardly belong together. */
const POOR = 0.8;

/** The map of a recording, how well both agree, and the choice of another one. */
export const MapFit = memo(function MapFit({
  info,
  onPlaced,
}: {
  info: RecordingInfo;
  onPlaced: () => void;
}) {
  const { name, map } = info;
  const maps = useLoaded(api.maps);
  const fits = useLoaded(useCallback(() => recordings.maps(name), [name]));
  const [step, setStep] = useState<string | null>(null);
  const [refusal, setRefusal] = useState<string | null>(null);
  const [picture, setPicture] = useState(false);
  const place = (on: string, estimate: boolean): void => {
    setRefusal(null);
    setStep(t`Sending the choice`);
    const offset = estimate && on === map ? info.offset.join(",") : "";
    recordings
      .place(name, { map: on, offset, estimate }, (job) => setStep(sentence(served(job.step))))
      .then(onPlaced, (error: unknown) => setRefusal(reasonOf(error)))
      .finally(() => setStep(null));
  };
  const known = new Map(fits.value?.map((fit) => [fit.map, fit.on_lane]));
  const choices = (maps.value ?? [])
    .map((one) => ({ name: one.name, share: known.get(one.name) ?? 0 }))
    .sort((one, other) => other.share - one.share || one.name.localeCompare(other.name))
    .map((one) => ({
      value: one.name,
      label: one.share > 0 ? t`${one.name} (${percent(one.share)} on its lanes)` : one.name,
    }));
  const moved = info.offset.some((value) => value !== 0);
  return (
    <>
      {map === null && (
        <Alert color="orange" mb="sm" title={t`It has no map yet`}>
          <Trans>
            No map came with it, and on none of yours are its vehicles on lanes. Choose one, or add it on the
            first page and come back.
          </Trans>
        </Alert>
      )}
      <Select
        label={t`Map of the recording`}
        data={choices}
        value={map}
        placeholder={t`Choose a map`}
        allowDeselect={false}
        disabled={step !== null}
        onChange={(next) => next !== null && next !== map && place(next, false)}
        mb="xs"
      />
      {step !== null && (
        <Group gap="sm" role="status" mb="xs">
          <Loader size={16} aria-hidden="true" />
          <Text size="sm">{step} …</Text>
        </Group>
      )}
      {refusal !== null && (
        <Alert color="red" mb="xs" title={t`It could not be placed`} style={{ overflowWrap: "anywhere" }}>
          {refusal}
        </Alert>
      )}
      {map !== null && (
        <>
          {info.vehicles && <Agreement of={info.vehicles} title={t`Vehicles`} places={t`on a lane`} />}
          {info.pedestrians && (
            <Agreement of={info.pedestrians} title={t`Pedestrians`} places={t`on a walk`} />
          )}
          {moved && (
            <Text size="xs" c="dimmed">
              <Trans>
                Moved by {fixed(info.offset[0], 2)} m east, {fixed(info.offset[1], 2)} m north, turned by{" "}
                {fixed(info.offset[2], 2)}°.
              </Trans>
            </Text>
          )}
          <Group gap="xs" mt="xs">
            <Button
              size="compact-sm"
              variant="default"
              disabled={!info.searched}
              onClick={() => setPicture(true)}
            >
              <Trans>Picture of the agreement</Trans>
            </Button>
            <Button
              size="compact-sm"
              variant="default"
              disabled={step !== null}
              onClick={() => place(map, true)}
            >
              <Trans>Move it onto the lanes</Trans>
            </Button>
          </Group>
        </>
      )}
      <Modal opened={picture} onClose={() => setPicture(false)} size="xl" title={t`Tracks on the map`}>
        {picture && (
          <img
            src={recordings.pictureUrl(name)}
            alt={t`Map with the tracks; places on no lane and against the direction of a lane are circled`}
            style={{ width: "100%", background: "#fff" }}
          />
        )}
      </Modal>
    </>
  );
});

function Agreement({ of, title, places }: { of: MapAgreement; title: string; places: string }) {
  const { on_lane: share, wrong_way: wrong, offset_95: far } = of;
  return (
    <div className="rec-agreement" data-poor={share < POOR}>
      <b>{percent(share)}</b>
      <span>
        {title} {places}
        {wrong > 0 && t`, ${percent(wrong)} against its direction`}
        {far != null && t`; 95 % within ${lengthText(far, 2)} of its middle`}
      </span>
    </div>
  );
}
