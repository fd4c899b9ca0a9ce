import { i18n } from "@lingui/core";
import { Trans } from "@lingui/react/macro";
import { useId } from "react";

import type { FitRow } from "../api/runs";
import { MARK_COLOR } from "../map/colors";
import { ticks } from "./scale";

const W = 352;
const H = 300;
const BOX = { left: 44, right: W - 12, top: 22, bottom: H - 36 };

/** Counted against simulated, a sign for each count; on the line both are the same. */
export function Scatter({ rows }: { rows: readonly FitRow[] }) {
  const id = useId();
  const marks = ticks(Math.max(1, ...rows.flatMap((row) => [row.counted, row.modelled])));
  const most = marks.at(-1) ?? 1;
  const px = (v: number): number => BOX.left + ((BOX.right - BOX.left) * v) / most;
  const py = (v: number): number => BOX.bottom - ((BOX.bottom - BOX.top) * v) / most;
  const unmet = rows.filter((row) => !row.met);
  return (
    <figure className="chart" aria-labelledby={id}>
      <figcaption id={id}>
        <Trans>Counted and simulated vehicles</Trans>
      </figcaption>
      <svg viewBox={`0 0 ${W} ${H}`} aria-hidden="true">
        {marks.map((v) => (
          <g key={v}>
            <line className="chart-grid" x1={BOX.left} x2={BOX.right} y1={py(v)} y2={py(v)} />
            <text x={BOX.left - 6} y={py(v) + 4} textAnchor="end">
              {v.toLocaleString(i18n.locale)}
            </text>
            <text x={px(v)} y={BOX.bottom + 15} textAnchor="middle">
              {v.toLocaleString(i18n.locale)}
            </text>
          </g>
        ))}
        <line className="chart-same" x1={px(0)} y1={py(0)} x2={px(most)} y2={py(most)} />
        {rows.map(
          (row, n) =>
            row.met && (
              <circle
                key={n}
                cx={px(row.counted)}
                cy={py(row.modelled)}
                r={3.5}
                fill={MARK_COLOR.met}
                fillOpacity={0.75}
              />
            ),
        )}
        {rows.map(
          (row, n) =>
            !row.met && (
              <path
                key={n}
                transform={`translate(${px(row.counted)} ${py(row.modelled)})`}
                d="M0-5.500 5 4H-5z"
                fill={MARK_COLOR.unmet}
                stroke="#fff"
                strokeWidth={0.8}
              />
            ),
        )}
        <text x={(BOX.left + BOX.right) / 2} y={H - 4} textAnchor="middle">
          <Trans>Counted</Trans>
        </text>
        <text x={2} y={12}>
          <Trans>Simulated</Trans>
        </text>
      </svg>
      <div className="chart-key" aria-hidden="true">
        <span>
          <Trans>
            <i style={{ background: MARK_COLOR.met, borderRadius: "50%", width: 9, height: 9 }} />
            met ({(rows.length - unmet.length).toLocaleString(i18n.locale)})
          </Trans>
        </span>
        <span>
          <Trans>
            <i
              style={{
                background: MARK_COLOR.unmet,
                clipPath: "polygon(50% 0, 100% 100%, 0 100%)",
                width: 11,
                height: 10,
              }}
            />
            not met ({unmet.length.toLocaleString(i18n.locale)})
          </Trans>
        </span>
      </div>
      <p>
        <Trans>
          On the line, as many vehicles were simulated as counted; below it too few, above it too many.
        </Trans>
      </p>
    </figure>
  );
}
