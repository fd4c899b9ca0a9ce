import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useId } from "react";

import type { SweepCase, SweepCases } from "../api/sweeps";
import { shortNumber } from "../editor/parameters";
import { type Axis, axesOf, scaleOf, titleOf, type Verdict, verdictOf } from "./plan";

const W = 760;
const H = 300;
const BOX = { left: 46, right: W - 46, top: 30, bottom: H - 30 };
const ORDER: readonly Verdict[] = ["other", "calm", "safe", "unsafe"];

interface Upright extends Axis {
  x: number;
  y: (value: number) => number;
  ends: readonly [number, number];
}

/** Each case as a line across upright axes: parameters, then what came of them. */
export function Parallel({ table, onOpen }: { table: SweepCases; onOpen: (name: string) => void }) {
  const id = useId();
  const axes = uprightsOf(table);
  if (axes.length < 2) return null;
  const lines = table.cases
    .map((one) => ({ one, verdict: verdictOf(one, table.columns), path: pathOf(one, axes) }))
    .filter(({ path }) => path !== "")
    .sort((a, b) => ORDER.indexOf(a.verdict) - ORDER.indexOf(b.verdict));
  return (
    <figure className="plane parallel" aria-labelledby={id}>
      <figcaption id={id}>
        <Trans>Parallel coordinates: each line is a case; it ends where a case has no value</Trans>
      </figcaption>
      {/* The table below has all of this for readers of the screen. */}
      <div
        className="plane-scroll"
        role="group"
        aria-label={t`Parallel coordinates of the cases`}
        tabIndex={0}
      >
        <svg viewBox={`0 0 ${W} ${H}`} aria-hidden="true">
          {lines.map(({ one, verdict, path }) => (
            <path
              key={one.case}
              className="parallel-line"
              data-case={one.case}
              data-verdict={verdict}
              data-open={one.status !== "refused"}
              d={path}
              onClick={() => {
                if (one.status !== "refused") onOpen(one.case);
              }}
            >
              <title>{titleOf(one, table, verdict)}</title>
            </path>
          ))}
          {axes.map((axis, n) => {
            const side = n === 0 ? "start" : n === axes.length - 1 ? "end" : "middle";
            const at = n === 0 ? 4 : n === axes.length - 1 ? W - 4 : axis.x;
            return (
              <g key={axis.name}>
                <line className="parallel-axis" x1={axis.x} x2={axis.x} y1={BOX.top} y2={BOX.bottom} />
                <text x={at} y={14} textAnchor={side}>
                  {axis.label}
                </text>
                {axis.ends.map((value, end) => (
                  <text key={end} className="parallel-end" x={axis.x + 5} y={axis.y(value) + (end ? 12 : -3)}>
                    {shortNumber(value)}
                  </text>
                ))}
              </g>
            );
          })}
        </svg>
      </div>
    </figure>
  );
}

function uprightsOf(table: SweepCases): Upright[] {
  const found = axesOf(table).filter(({ name }) => name !== "collision");
  return found.map((axis, n) => {
    const values = table.cases.map(axis.of).filter((one) => one !== null);
    const [y] = scaleOf(values, BOX.bottom, BOX.top);
    const x = BOX.left + ((BOX.right - BOX.left) * n) / Math.max(1, found.length - 1);
    return { ...axis, x, y, ends: [Math.max(...values), Math.min(...values)] };
  });
}

/** A line through the values of a case, broken where it has none. */
function pathOf(one: SweepCase, axes: readonly Upright[]): string {
  let [path, pen] = ["", false];
  for (const { of, x, y } of axes) {
    const value = of(one);
    if (value !== null) path += `${pen ? "L" : "M"}${x.toFixed(1)},${y(value)}`;
    pen = value !== null;
  }
  return path.includes("L") ? path : "";
}
