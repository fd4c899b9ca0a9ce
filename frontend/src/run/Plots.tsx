import { Alert, Loader } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useCallback } from "react";

import { hasClock } from "../language/moments";
import { unitFor, toShown } from "../language/units";
import { runs } from "../api/runs";
import { useLoaded } from "../ui/useLoaded";
import { Chart } from "./Chart";

const BLUE = "var(--mantine-color-blue-6)";
const GREEN = "var(--mantine-color-teal-7)";
const ORANGE = "var(--mantine-color-orange-7)";
const km = (values: readonly (number | null)[]): (number | null)[] =>
  values.map((v) => (v === null ? null : toShown(v, "speed")));

/** A finished run over time. */
export function Plots({ run }: { run: string }) {
  const { value, error } = useLoaded(useCallback(() => runs.curves(run), [run]));
  if (error)
    return (
      <Alert color="gray" title={t`There are no charts of this run`}>
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label={t`Loading the charts`} />;
  const { counts, speeds, shares } = value;
  const waits = counts.waiting.some((n) => n > 0);
  return (
    <>
      <Chart
        title={t`Road users in the network`}
        moments
        xLabel={hasClock() ? t`Time of day` : t`Time, s`}
        yLabel={t`Road users`}
        x={counts.time}
        series={[
          { name: t`On the road`, color: BLUE, values: counts.running },
          ...(waits ? [{ name: t`Waiting to be inserted`, color: ORANGE, values: counts.waiting }] : []),
        ]}
      >
        <Trans>
          A line that keeps climbing means that more road users enter than leave: congestion builds up.
        </Trans>
      </Chart>
      <Chart
        title={t`Arrivals`}
        moments
        xLabel={hasClock() ? t`Time of day` : t`Time, s`}
        yLabel={t`Arrived so far`}
        x={counts.time}
        series={[{ name: t`Arrived`, color: GREEN, values: counts.arrived }]}
      >
        <Trans>
          A steady climb means that traffic flows; where the line is flat, no road user reached its goal.
        </Trans>
      </Chart>
      <Chart
        title={t`Speed of vehicles`}
        moments
        xLabel={hasClock() ? t`Time of day` : t`Time, s`}
        yLabel={unitFor("speed").sign}
        x={speeds.time}
        series={[{ name: t`Mean`, color: BLUE, values: km(speeds.mean) }]}
        band={{ name: t`10th to 90th percentile`, low: km(speeds.low), high: km(speeds.high) }}
      >
        <Trans>
          A wide band means that some drive freely while others wait. Stopped vehicles are included.
        </Trans>
      </Chart>
      {shares.share.length > 0 && (
        <Chart
          title={t`Speed distribution`}
          xLabel={t`Speed, ${unitFor("speed").sign}`}
          yLabel={t`Share of the time, %`}
          bars
          x={shares.edges.map((v) => toShown(v, "speed"))}
          series={[{ name: t`Share`, color: BLUE, values: shares.share.map((v) => 100 * v) }]}
        >
          <Trans>
            A high bar on the left means much stopping and crawling; bars on the right are free flow.
          </Trans>
        </Chart>
      )}
    </>
  );
}
