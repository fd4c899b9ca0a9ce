import { t } from "@lingui/core/macro";

import "./carla.css";

import { Switch, Text } from "@mantine/core";
import { useEffect } from "react";

import { localized } from "../language/localized";
import type { CarlaInfo } from "../api/carla";
import { useCarla } from "./useCarla";
import { served } from "../language/served";

const WORD = localized((): Record<CarlaInfo["state"], string> => ({
  connected: "connected",
  absent: t`not connected`,
  wrong_version: t`has another version`,
}));

/** Whether CARLA is connected, and the offer to show the run in it. */
export function CarlaChoice({ chosen, onChoose }: { chosen: boolean; onChoose: (chosen: boolean) => void }) {
  const info = useCarla();
  const there = info?.state === "connected";
  // It may go away after it was chosen.
  useEffect(() => {
    if (info && !there && chosen) onChoose(false);
  }, [info, there, chosen, onChoose]);
  return (
    <div className="carla-choice" role="group" aria-label="CARLA">
      <span className="carla-state" role="status">
        <i aria-hidden="true" data-state={info?.state ?? "unknown"} />
        CARLA {info ? WORD()[info.state] : "…"}
      </span>
      {there ? (
        <Switch
          label={t`Also show the run in CARLA`}
          description={t`The same road users and lights, with a picture from above`}
          checked={chosen}
          onChange={(event) => onChoose(event.currentTarget.checked)}
        />
      ) : (
        info && (
          <Text size="xs" c="dimmed">
            {served(info.message)}
          </Text>
        )
      )}
    </div>
  );
}
