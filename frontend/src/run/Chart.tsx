import { i18n } from "@lingui/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { type ReactNode, useId } from "react";

import { dayTicks, hasClock, shortClock } from "../language/moments";
import { nth } from "../lists";
import { thinned, ticks } from "./scale";

export interface Series {
  name: string;
  color: string;
  values: readonly (number | null)[];
}

interface Props {
  title: string;
  xLabel: string;
  yLabel: string;
  x: readonly number[];
  series: readonly Series[];
  /** Area between two values for each x, said in `series` words by its name. */
  band?: { name: string; low: readonly (number | null)[]; high: readonly (number | null)[] };
  /** Whether x are moments of the run, which are times of day if it has a clock. */
  moments?: boolean;
  /** Bars from each x to the next one, instead of lines; one series. */
  bars?: boolean;
  /** How to read it. */
  children: ReactNode;
}

const W = 352;
const H = 200;
const BOX = { left: 40, right: W - 10, top: 28, bottom: H - 34 };
const ROWS = 24;

/** A small chart with round axes; the same numbers are a table below it. */
export function Chart({
  title,
  xLabel,
  yLabel,
  x,
  series,
  band,
  bars = false,
  moments = false,
  children,
}: Props) {
  const id = useId();
  const color = series[0]?.color;
  const known = [...series.flatMap((one) => one.values), ...(band?.high ?? [])].filter((v) => v !== null);
  const yTicks = ticks(Math.max(0, ...known));
  const [xMost, yMost] = [x.at(-1) || 1, yTicks.at(-1) ?? 1];
  const ofDay = moments && hasClock();
  const xTicks = ofDay ? dayTicks(0, xMost, 5) : ticks(xMost, 6).filter((v) => v <= xMost * 1.001);
  const xWord = (v: number): string => (ofDay ? shortClock(v, xMost) : round(v));
  const px = (v: number): number => BOX.left + ((BOX.right - BOX.left) * v) / xMost;
  const py = (v: number): number => BOX.bottom - ((BOX.bottom - BOX.top) * v) / yMost;
  const point = (v: number | null | undefined, k: number): string | null =>
    v == null ? null : `${px(nth(x, k)).toFixed(1)} ${py(v).toFixed(1)}`;
  return (
    <figure className="chart" aria-labelledby={id}>
      <figcaption id={id}>{title}</figcaption>
      <svg viewBox={`0 0 ${W} ${H}`} aria-hidden="true">
        {yTicks.map((v) => (
          <g key={v}>
            <line className="chart-grid" x1={BOX.left} x2={BOX.right} y1={py(v)} y2={py(v)} />
            <text x={BOX.left - 6} y={py(v) + 4} textAnchor="end">
              {v.toLocaleString(i18n.locale)}
            </text>
          </g>
        ))}
        {xTicks.map((v) => (
          <text key={v} x={px(v)} y={BOX.bottom + 15} textAnchor="middle">
            {ofDay ? shortClock(v, xMost) : v.toLocaleString(i18n.locale)}
          </text>
        ))}
        <text x={(BOX.left + BOX.right) / 2} y={H - 3} textAnchor="middle">
          {xLabel}
        </text>
        <text x={2} y={12}>
          {yLabel}
        </text>
        {band && <path d={area(band.low.map(point), band.high.map(point))} fill={color} opacity={0.22} />}
        {bars
          ? series[0]?.values.map((v, k) =>
              v === null || k + 1 >= x.length ? null : (
                <rect
                  key={k}
                  x={px(nth(x, k)) + 0.7}
                  width={Math.max(0.5, px(nth(x, k + 1)) - px(nth(x, k)) - 1.4)}
                  y={py(v)}
                  height={BOX.bottom - py(v)}
                  fill={color}
                />
              ),
            )
          : series.map((one) => (
              <path
                key={one.name}
                d={path(one.values.map(point))}
                fill="none"
                stroke={one.color}
                strokeWidth={2}
                strokeLinejoin="round"
              />
            ))}
      </svg>
      {(series.length > 1 || band) && (
        <div className="chart-key" aria-hidden="true">
          {series.map((one) => (
            <span key={one.name}>
              <i style={{ background: one.color }} />
              {one.name}
            </span>
          ))}
          {band && (
            <span>
              <i style={{ background: color, opacity: 0.35, height: 9 }} />
              {band.name}
            </span>
          )}
        </div>
      )}
      <p>{children}</p>
      <details>
        <summary>
          <Trans>{title} in numbers</Trans>
        </summary>
        <Numbers
          title={title}
          xLabel={xLabel}
          yLabel={yLabel}
          x={x}
          series={series}
          bars={bars}
          xWord={xWord}
        />
      </details>
    </figure>
  );
}

function Numbers({
  title,
  xLabel,
  yLabel,
  x,
  series,
  bars,
  xWord,
}: {
  title: string;
  xLabel: string;
  yLabel: string;
  x: readonly number[];
  series: readonly Series[];
  bars: boolean;
  xWord: (x: number) => string;
}) {
  const rows = x.slice(0, series[0]?.values.length).map((_, k) => k);
  return (
    <table aria-label={t`${title} in numbers`} style={{ width: "100%", fontSize: 12.5, textAlign: "right" }}>
      <thead>
        <tr>
          <th scope="col">{xLabel}</th>
          {series.map((one) => (
            <th scope="col" key={one.name}>
              {series.length > 1 ? one.name : yLabel}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {(bars ? rows : thinned(rows, ROWS)).map((k) => (
          <tr key={k}>
            <th scope="row" style={{ fontWeight: 400 }}>
              {bars ? t`${xWord(nth(x, k))} to ${xWord(nth(x, k + 1))}` : xWord(nth(x, k))}
            </th>
            {series.map((one) => (
              <td key={one.name}>{said(one.values[k])}</td>
            ))}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

const round = (v: number): string => v.toLocaleString(i18n.locale, { maximumFractionDigits: 1 });
const said = (v: number | null | undefined): string => (v == null ? "–" : round(v));

/** Lines through what is known; a gap where nothing is. */
function path(points: readonly (string | null)[]): string {
  return points
    .map((at, k) => (at === null ? "" : `${k > 0 && points[k - 1] !== null ? "L" : "M"}${at}`))
    .join("");
}

function area(low: readonly (string | null)[], high: readonly (string | null)[]): string {
  const parts: string[] = [];
  for (let k = 0; k < low.length; k++) {
    if (low[k] == null || high[k] == null) continue;
    let end = k;
    while (low[end + 1] != null && high[end + 1] != null) end += 1;
    parts.push(`M${[...high.slice(k, end + 1), ...low.slice(k, end + 1).reverse()].join("L")}Z`);
    k = end;
  }
  return parts.join("");
}
