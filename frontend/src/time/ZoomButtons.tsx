import { ActionIcon, Tooltip } from "@mantine/core";
import { t } from "@lingui/core/macro";
import type { ReactNode } from "react";

import { IconFit, IconMinus, IconPlus } from "../ui/icons";

/** Shows less of the time in a time bar, more of it, or all. */
export function ZoomButtons({ onZoom, onWhole }: { onZoom: (factor: number) => void; onWhole: () => void }) {
  return (
    <span className="time-buttons" role="group" aria-label={t`What is in sight`}>
      <Tool label={t`Show less time`} onClick={() => onZoom(2)}>
        <IconPlus size={15} />
      </Tool>
      <Tool label={t`Show more time`} onClick={() => onZoom(0.5)}>
        <IconMinus size={15} />
      </Tool>
      <Tool label={t`Show the whole run`} onClick={onWhole}>
        <IconFit size={15} />
      </Tool>
    </span>
  );
}

function Tool({ label, onClick, children }: { label: string; onClick: () => void; children: ReactNode }) {
  return (
    <Tooltip label={label}>
      <ActionIcon size="sm" variant="default" aria-label={label} onClick={onClick}>
        {children}
      </ActionIcon>
    </Tooltip>
  );
}
