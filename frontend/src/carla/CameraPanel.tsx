import { t } from "@lingui/core/macro";

import "./carla.css";

import { useState } from "react";

import { localized } from "../language/localized";
import { carla } from "../api/carla";

type Shown = "waiting" | "moving" | "ended";

const WORD = localized((): Record<Shown, string> => ({
  waiting: t`Waiting for the first picture …`,
  moving: t`CARLA, from above`,
  ended: t`CARLA, from above: the last picture`,
}));

/** The picture that CARLA's camera gives of a run that is running. */
export function CameraPanel({ run, over }: { run: string; over: boolean }) {
  const [state, setState] = useState<Shown>("waiting");
  const shown = over && state === "moving" ? "ended" : state;
  if (over && state === "waiting") return null;
  return (
    <figure className="camera">
      <img
        src={carla.cameraUrl(run)}
        alt={t`The run in CARLA, seen from above`}
        data-state={shown}
        onLoad={() => setState("moving")}
        onError={() => setState("ended")}
      />
      <figcaption>{WORD()[shown]}</figcaption>
    </figure>
  );
}
