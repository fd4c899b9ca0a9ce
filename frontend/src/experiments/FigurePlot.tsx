import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useId } from "react";

import { served } from "../language/served";
import type { FigureGroup, StudyResults } from "../api/studies";
import { scaleOf } from "./plan";
import { variantWord } from "./groups";

const W = 760;
const ROW = 34;
/** Width of a letter of a name, about. */
const LETTER = 7.6;
/** Rows that are drawn; the table has all. */
const MOST = 40;
/** Letters of a name that have room on the left. */
const LETTERS = 32;

/** A figure by scenario and variant: each dot is a run, the bar the mean and its interval. */
export function FigurePlot({ results }: { results: StudyResults }) {
  const id = useId();
  const groups = results.groups.filter(({ values }) => values.length > 0).slice(0, MOST);
  const figure = results.figures.find(({ name }) => name === results.figure);
  if (groups.length === 0) return null;
  const ends = groups.flatMap(({ mean, half_width: half, values }) => [
    ...values,
    ...(mean === null || half === null ? [] : [mean - half, mean + half]),
  ]);
  const single = new Set(groups.map(({ scenario }) => scenario)).size === 1;
  const rows = groups.map((one) => ({ one, name: nameOf(one, single) }));
  const left = 20 + LETTER * Math.max(...rows.map(({ name }) => name.length));
  const [px, marks] = scaleOf(ends, left, W - 20);
  const height = groups.length * ROW + 52;
  const bottom = height - 40;
  const unit = figure?.unit ? `, ${figure.unit}` : "";
  return (
    <figure className="plane" aria-labelledby={id}>
      <figcaption id={id}>
        <Trans>
          {served(figure?.label ?? results.figure)}
          {unit}: each dot is a run, the bar is the mean with its 95 % confidence interval
        </Trans>
      </figcaption>
      {/* The table below has all of this for readers of the screen. */}
      <div className="plane-scroll" role="group" aria-label={t`Figure by variant`} tabIndex={0}>
        <svg viewBox={`0 0 ${W} ${height}`} aria-hidden="true">
          {marks.map((mark) => (
            <g key={mark}>
              <path className="plane-grid" d={`M${px(mark)},6V${bottom}`} />
              <text x={px(mark)} y={bottom + 18} textAnchor="middle">
                {mark}
              </text>
            </g>
          ))}
          <text x={(left + W - 20) / 2} y={height - 4} textAnchor="middle">
            {served(figure?.label ?? results.figure) + unit}
          </text>
          {rows.map(({ one, name }, n) => (
            <Row
              key={`${one.scenario}/${one.variant}`}
              one={one}
              name={name}
              left={left}
              y={ROW * (n + 0.5) + 8}
              px={px}
            />
          ))}
        </svg>
      </div>
    </figure>
  );
}

function nameOf({ scenario, variant }: FigureGroup, single: boolean): string {
  const name = single ? variantWord(variant) : `${scenario}, ${variantWord(variant)}`;
  return name.length > LETTERS ? `…${name.slice(1 - LETTERS)}` : name;
}

function Row({
  one,
  name,
  left,
  y,
  px,
}: {
  one: FigureGroup;
  name: string;
  left: number;
  y: number;
  px: (value: number) => number;
}) {
  const { mean, half_width: half, values } = one;
  return (
    <g>
      <text x={left - 14} y={y + 4} textAnchor="end">
        {name}
      </text>
      {mean !== null && half !== null && (
        <path
          className="run-mean"
          d={`M${px(mean - half)},${y}H${px(mean + half)}M${px(mean)},${y - 10}V${y + 10}`}
        />
      )}
      {values.map((value, n) => (
        <circle key={n} className="run-dot" cx={px(value)} cy={y} r={4.5} />
      ))}
    </g>
  );
}
