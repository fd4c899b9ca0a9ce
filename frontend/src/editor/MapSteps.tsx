import { Button, Group, Text } from "@mantine/core";
import { useCallback } from "react";

import { api } from "../api/client";
import { go } from "../ui/address";
import { useLoaded } from "../ui/useLoaded";
import { count, mapFacts } from "../ui/words";
import type { Region } from "./asked";

export function MapStep({ name, onShow }: { name: string; onShow: () => void }) {
  const load = useCallback(() => api.map(name), [name]);
  const { value } = useLoaded(load);
  return (
    <>
      <Text size="sm">{value ? mapFacts(value.statistics).join(" · ") : "…"}</Text>
      <Group>
        <Button size="compact-sm" variant="default" onClick={onShow}>
          Show the whole map
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={() => go({ view: "catalogue" })}>
          Choose another map
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
  onBegin: () => void;
  onShow: () => void;
}) {
  const many = (
    <>
      <Button size="compact-sm" variant="default" onClick={onWhole}>
        Take the whole map
      </Button>
      <Button size="compact-sm" variant="default" onClick={onSeen}>
        Take all that I see
      </Button>
    </>
  );
  if (segments === 0) {
    return (
      <>
        <Text size="sm">
          Click the road or junction where your scenario begins. It turns dark blue; then let the region grow
          around it. Or drag a rectangle with Shift held down.
        </Text>
        <Group>
          <Button size="compact-sm" variant="default" onClick={onBegin}>
            Begin in the middle of what I see
          </Button>
          {many}
        </Group>
      </>
    );
  }
  return (
    <>
      <Text size="sm">
        Click a <b>light-blue</b> segment to add it, or a segment of the region to take it out again. A
        rectangle, dragged with Shift held down, adds all in it.
      </Text>
      <Group>
        {(!region.current || region.candidates.length > 0) && (
          <Button size="compact-sm" variant="default" disabled={!region.current} onClick={onAll}>
            {region.current
              ? `Add all ${count(region.candidates.length, "neighbour")}`
              : "Add all neighbours"}
          </Button>
        )}
        {many}
        <Button size="compact-sm" variant="subtle" onClick={onShow}>
          Show the region
        </Button>
      </Group>
      <Button onClick={onNext}>Next: weather and time</Button>
    </>
  );
}
