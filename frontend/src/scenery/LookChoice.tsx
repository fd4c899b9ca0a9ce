import "./scenery.css";

import { Select } from "@mantine/core";
import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";
import { type Camera, isCamera } from "./cameras";

const PLAN = "plan";
const LOOKS = localized(() => [
  { value: PLAN, label: t`Plan` },
  { value: "above", label: t`3D, from above` },
  { value: "behind", label: t`3D, following` },
  { value: "seat", label: t`3D, driver's seat` },
]);

/** How a map is looked at: as a plan, or in three dimensions from somewhere. */
export function LookChoice({
  camera,
  onLook,
}: {
  /** Null for the plan. */
  camera: Camera | null;
  onLook: (camera: Camera | null) => void;
}) {
  return (
    <Select
      size="xs"
      w={148}
      aria-label={t`View`}
      allowDeselect={false}
      data={LOOKS()}
      value={camera ?? PLAN}
      onChange={(next) => onLook(isCamera(next) ? next : null)}
    />
  );
}
