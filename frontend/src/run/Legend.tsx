import { useComputedColorScheme } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";

import { CATEGORIES, type Category } from "../api/types";
import { BRAKES, CATEGORY_COLOR, DARK, EGO, INDICATOR, LIGHT, MARK_COLOR, SIGNAL_COLOR } from "../map/colors";
import type { MarkKind } from "../map/scene";
import { CategoryGlyph } from "../ui/icons";
import { CATEGORY_WORD } from "../ui/words";
import { MARK_WORD } from "./incidents";
import { type ColourBy, SCALES } from "./tint";
import type { LaneLegend } from "./useLaneUse";

/** What the picture's colours and signs mean; only what can be in it. */
export function Legend({
  categories,
  ego,
  lights,
  lamps,
  marks,
  by = "kind",
  lanes = null,
}: {
  categories: ReadonlySet<Category>;
  ego: boolean;
  /** Whether traffic lights are shown. */
  lights: boolean;
  /** Whether brake lights and indicators are shown: a recording has none. */
  lamps: boolean;
  marks: ReadonlySet<MarkKind>;
  /** What the colours of road users say. */
  by?: ColourBy;
  /** What the colours of lanes mean, where they say something. */
  lanes?: (LaneLegend & { word: string }) | null;
}) {
  const dark = useComputedColorScheme("light") === "dark";
  if (categories.size === 0 && !lanes) return null;
  return (
    <ul className="map-legend" aria-label={t`What is shown`} style={{ listStyle: "none", margin: 0 }}>
      {lanes && <LaneRows {...lanes} unused={(dark ? DARK : LIGHT).areas.road ?? ""} />}
      {by !== "kind" &&
        SCALES()[by].legend.map((words, n) => (
          <li key={words}>
            <span>
              <i style={{ background: SCALES()[by].colors[n] }} />
              {words}
            </span>
          </li>
        ))}
      {CATEGORIES.filter((one) => by === "kind" && categories.has(one)).map((kind) => (
        <li key={kind}>
          <span>
            <i style={{ background: CATEGORY_COLOR[kind] }} />
            <CategoryGlyph category={kind} size={16} />
            {CATEGORY_WORD()[kind]}
          </span>
        </li>
      ))}
      {ego && (
        <li>
          <span>
            <Trans>
              <i style={{ border: `2px solid ${EGO}`, borderRadius: "50%", boxSizing: "border-box" }} />
              Your vehicle
            </Trans>
          </span>
        </li>
      )}
      {lights && (
        <li className="wide">
          <span>
            <Trans>
              <SignalShapes />
              Traffic light: go, give way, yellow, red
            </Trans>
          </span>
        </li>
      )}
      {lamps && (
        <li>
          <span>
            <Trans>
              <i style={{ background: BRAKES }} />
              Brakes
            </Trans>
          </span>
        </li>
      )}
      {lamps && (
        <li>
          <span>
            <Trans>
              <i style={{ background: INDICATOR }} />
              Indicator
            </Trans>
          </span>
        </li>
      )}
      {[...marks].map((kind) => (
        <li key={kind}>
          <span>
            <i className="mark" style={{ background: MARK_COLOR[kind] }} />
            {MARK_WORD()[kind]}
          </span>
        </li>
      ))}
    </ul>
  );
}

/** What the colours of lanes mean, and that of lanes without vehicles. */
function LaneRows({ word, colors, words, unused }: LaneLegend & { word: string; unused: string }) {
  return (
    <>
      <li className="lane-row wide">
        <span>
          <Trans>
            <i style={{ background: "transparent" }} />
            Lanes: {word}
          </Trans>
        </span>
      </li>
      {words.map((text, n) => (
        <li key={text} className="lane-row">
          <span>
            <i style={{ background: colors[n] }} />
            {text}
          </span>
        </li>
      ))}
      <li className="lane-row">
        <span>
          <Trans>
            <i style={{ background: unused }} />
            No vehicle
          </Trans>
        </span>
      </li>
    </>
  );
}

/** The shapes of signals at their stop lines, as the map draws them. */
function SignalShapes() {
  const { green, yellow, red } = SIGNAL_COLOR;
  return (
    <svg width="58" height="12" aria-hidden="true" stroke="#1b1f24" strokeWidth="1">
      <path d="M2 1l8 5-8 5z" fill={green} />
      <path d="M17 1.500l7 4.500-7 4.500z" fill="none" stroke={green} strokeWidth="2" />
      <path d="M33 1h4v4h-4zM33 7h4v4h-4z" fill={yellow} />
      <path d="M49 1h4v10h-4z" fill={red} />
    </svg>
  );
}
