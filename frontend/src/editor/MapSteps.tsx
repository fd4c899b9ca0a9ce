import { Button, Group, NumberInput, Text } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback, useState } from "react";

import { api } from "../api/client";
import { go } from "../ui/address";
import { shownUnit } from "../language/units";
import { useLoaded } from "../ui/useLoaded";
import { mapFacts } from "../ui/words";
import type { Region } from "./asked";

/** Metres that are suggested for the surroundings of a place. */
const NEAR = 300;

export function MapStep({ name, onShow }: { name: string; onShow: () => void }) {
  const load = useCallback(() => api.map(name), [name]);
  const { value } = useLoaded(load);
  return (
    <>
      <Text size="sm">{value ? mapFacts(value.statistics).join(" · ") : "…"}</Text>
      <Group>
        <Button size="compact-sm" variant="default" onClick={onShow}>
          <Trans>Show the whole map</Trans>
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={() => go({ view: "catalogue" })}>
          <Trans>Choose another map</Trans>
        </Button>
      </Group>
    </>
  );
}

export function RegionStep({
  segments,
  region,
  onNext,
  onAll,
  onWhole,
  onSeen,
  onWithin,
  onBegin,
  onShow,
}: {
  segments: number;
  region: Region;
  onNext: () => void;
  onAll: () => void;
  /** Adds every segment of the map. */
  onWhole: () => void;
  /** Adds what is in sight. */
  onSeen: () => void;
  /** Adds what lies within so many metres of the middle of what is in sight. */
  onWithin: (metres: number) => void;
  onBegin: () => void;
  onShow: () => void;
}) {
  const { sign, shown, kept } = shownUnit("m");
  // In the reader's unit, in which 300 m are a round number, too.
  const [distance, setDistance] = useState<number | string>(Number(shown(NEAR).toPrecision(1)));
  const many = (
    <>
      <Button size="compact-sm" variant="default" onClick={onWhole}>
        <Trans>Select whole map</Trans>
      </Button>
      <Button size="compact-sm" variant="default" onClick={onSeen}>
        <Trans>Select visible area</Trans>
      </Button>
      <Group gap={6} align="center">
        <Button
          size="compact-sm"
          variant="default"
          disabled={typeof distance !== "number"}
          onClick={() => onWithin(kept(Number(distance)))}
        >
          <Trans>Select all within</Trans>
        </Button>
        <NumberInput
          size="xs"
          w={92}
          aria-label={t`Distance from the centre of the visible area`}
          suffix={` ${sign}`}
          min={Math.ceil(shown(10))}
          max={Math.floor(shown(20_000))}
          step={50}
          allowDecimal={false}
          value={distance}
          onChange={setDistance}
        />
        <Text size="sm">
          <Trans>of the centre</Trans>
        </Text>
      </Group>
    </>
  );
  if (segments === 0) {
    return (
      <>
        <Text size="sm">
          <Trans>
            Click the road or junction where your scenario begins. It turns dark blue; then let the region
            grow around it. Or drag a rectangle with Shift held down, or a line around it with Ctrl.
          </Trans>
        </Text>
        <Group>
          <Button size="compact-sm" variant="default" onClick={onBegin}>
            <Trans>Start at the map centre</Trans>
          </Button>
          {many}
        </Group>
      </>
    );
  }
  return (
    <>
      <Text size="sm">
        <Trans>
          Click a{" "}
          <b>
            <Trans>light-blue</Trans>
          </b>{" "}
          segment to add it, or a segment of the region to take it out again. A rectangle, dragged with Shift
          held down, adds all in it; so does a line around it, with Ctrl.
        </Trans>
      </Text>
      <Group>
        {(!region.current || region.candidates.length > 0) && (
          <Button size="compact-sm" variant="default" disabled={!region.current} onClick={onAll}>
            {region.current
              ? t`Add all ${plural(region.candidates.length, { one: "# neighbour", other: "# neighbours" })}`
              : t`Add all neighbours`}
          </Button>
        )}
        {many}
        <Button size="compact-sm" variant="subtle" onClick={onShow}>
          <Trans>Show the region</Trans>
        </Button>
      </Group>
      <Button onClick={onNext}>
        <Trans>Next: weather and time</Trans>
      </Button>
    </>
  );
}
