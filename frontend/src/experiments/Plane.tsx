import { Group, Select } from "@mantine/core";
import { useMediaQuery } from "@mantine/hooks";
import { t } from "@lingui/core/macro";
import { useId, useState } from "react";

import type { SweepCases } from "../api/sweeps";
import { shortNumber } from "../editor/parameters";
import { axesOf, scaleOf, titleOf, type Verdict, VERDICT_WORD, verdictOf } from "./plan";

const H = 420;
const ORDER: readonly Verdict[] = ["other", "calm", "safe", "unsafe"];

/** Cases in the plane of two parameters, and the boundary between those that are safe and not. */
export function Plane({ table, onOpen }: { table: SweepCases; onOpen: (name: string) => void }) {
  const id = useId();
  const W = useMediaQuery("(max-width: 760px)") ? 380 : 760;
  const BOX = { left: 62, right: W - 16, top: 16, bottom: H - 48 };
  const axes = axesOf(table);
  const [chosen, setChosen] = useState<[number, number]>([0, 1]);
  const [across, up] = [axes[chosen[0]], axes[chosen[1]]];
  const dots = table.cases.flatMap((one) => {
    const [x, y] = [across?.of(one) ?? null, up?.of(one) ?? null];
    return x === null || y === null ? [] : [{ one, x, y, verdict: verdictOf(one, table.columns) }];
  });
  if (!across || !up || dots.length === 0) return null;
  const [px, xs] = scaleOf(
    dots.map(({ x }) => x),
    BOX.left,
    BOX.right,
  );
  const [py, ys] = scaleOf(
    dots.map(({ y }) => y),
    BOX.bottom,
    BOX.top,
  );
  const plane = table.parameters.length === 2 && chosen[0] < 2 && chosen[1] < 2;
  const flip = chosen[0] === 1;
  const line = plane
    ? table.boundary
        .map((ends) =>
          ends.map(([a, b]) => (flip ? [b, a] : [a, b])).map(([x = 0, y = 0]) => `${px(x)},${py(y)}`),
        )
        .map(([from, to]) => `M${from}L${to}`)
        .join("")
    : "";
  const pick = (label: string, at: 0 | 1) => (
    <Select
      size="xs"
      label={label}
      data={axes.map((axis, n) => ({ value: String(n), label: axis.label, disabled: n === chosen[1 - at] }))}
      value={String(chosen[at])}
      allowDeselect={false}
      onChange={(next) => {
        if (next !== null) setChosen(at === 0 ? [Number(next), chosen[1]] : [chosen[0], Number(next)]);
      }}
    />
  );
  return (
    <figure className="plane" aria-labelledby={id}>
      <figcaption id={id}>
        {plane && line
          ? t`Safe and not: each dot is a case, the line is the boundary, half-way between neighbours`
          : t`Safe and not: each dot is a case`}
      </figcaption>
      {axes.length > 2 && (
        <Group gap="sm" mb={6}>
          {pick(t`Across`, 0)}
          {pick(t`Up`, 1)}
        </Group>
      )}
      {/* The table below has all of this for readers of the screen. */}
      <div className="plane-scroll" role="group" aria-label={t`Plane of the cases`} tabIndex={0}>
        <svg viewBox={`0 0 ${W} ${H}`} aria-hidden="true">
          {xs.map((v) => (
            <g key={v}>
              <line className="plane-grid" x1={px(v)} x2={px(v)} y1={BOX.top} y2={BOX.bottom} />
              <text x={px(v)} y={BOX.bottom + 18} textAnchor="middle">
                {shortNumber(v)}
              </text>
            </g>
          ))}
          {ys.map((v) => (
            <g key={v}>
              <line className="plane-grid" x1={BOX.left} x2={BOX.right} y1={py(v)} y2={py(v)} />
              <text x={BOX.left - 8} y={py(v) + 4} textAnchor="end">
                {shortNumber(v)}
              </text>
            </g>
          ))}
          <text x={(BOX.left + BOX.right) / 2} y={H - 8} textAnchor="middle">
            {across.label}
          </text>
          <text transform={`translate(14 ${(BOX.top + BOX.bottom) / 2}) rotate(-90)`} textAnchor="middle">
            {up.label}
          </text>
          {line && <path className="plane-boundary" d={line} />}
          {ORDER.flatMap((verdict) =>
            dots
              .filter((dot) => dot.verdict === verdict)
              .map(({ one, x, y }) => (
                <circle
                  key={one.case}
                  className="plane-dot"
                  data-case={one.case}
                  data-verdict={verdict}
                  data-open={one.status !== "refused"}
                  cx={px(x)}
                  cy={py(y)}
                  r={table.cases.length > 400 ? 4 : 6}
                  onClick={() => {
                    if (one.status !== "refused") onOpen(one.case);
                  }}
                >
                  <title>{titleOf(one, table, verdict)}</title>
                </circle>
              )),
          )}
        </svg>
      </div>
      <div className="plane-key" aria-hidden="true">
        {ORDER.filter((verdict) => dots.some((dot) => dot.verdict === verdict)).map((verdict) => (
          <span key={verdict} className="verdict" data-verdict={verdict}>
            {VERDICT_WORD()[verdict]} ({dots.filter((dot) => dot.verdict === verdict).length})
          </span>
        ))}
      </div>
    </figure>
  );
}
