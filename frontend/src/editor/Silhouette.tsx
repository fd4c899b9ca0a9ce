import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { lengthText } from "../language/units";
import type { Actor } from "../api/types";
import { CATEGORY_COLOR } from "../map/colors";

/** The body from above, to scale with a lane of 3.5 m. */
export function Silhouette({ actor, length, width }: { actor: Actor; length: number; width: number }) {
  const y = 1.75 - width / 2 - actor.lateral_offset;
  // The nose is a blunt wedge, so that one sees where the front is.
  const straight = Math.max(length - width * 0.35, 0.1);
  const [nose, cheek, brow] = [width * 0.35, width * 0.28, width * 0.44];
  return (
    <figure style={{ margin: 0 }}>
      <svg
        className="silhouette"
        viewBox="-1 -0.300 22 4.100"
        role="img"
        aria-label={t`${lengthText(length, 1)} long, ${lengthText(width, 1)} wide, on a lane of ${lengthText(3.5, 1)}`}
      >
        <rect x={-1} y={0} width={22} height={3.5} fill="#969ea8" />
        <path d="M-1 0h22M-1 3.500h22" stroke="#fff" strokeWidth={0.15} strokeDasharray="1.500 1" />
        <path
          d={`M8 ${y}h${straight}l${nose} ${cheek}v${brow}l${-nose} ${cheek}h${-straight}z`}
          fill={CATEGORY_COLOR[actor.category]}
          stroke="#fff"
          strokeWidth={0.08}
        />
      </svg>
      <figcaption style={{ fontSize: 12 }}>
        <Trans>
          {lengthText(length, 1)} long, {lengthText(width, 1)} wide
        </Trans>
      </figcaption>
    </figure>
  );
}
