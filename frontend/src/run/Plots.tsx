import { Alert, Loader } from "@mantine/core";
import { useCallback } from "react";

import { runs } from "../api/runs";
import { useLoaded } from "../ui/useLoaded";
import { Chart } from "./Chart";

const BLUE = "var(--mantine-color-blue-6)";
const GREEN = "var(--mantine-color-teal-7)";
const ORANGE = "var(--mantine-color-orange-7)";
const km = (values: readonly (number | null)[]): (number | null)[] =>
  values.map((v) => (v === null ? null : v * 3.6));

/** A finished run over time. */
export function Plots({ run }: { run: string }) {
  const { value, error } = useLoaded(useCallback(() => runs.curves(run), [run]));
  if (error)
    return (
      <Alert color="gray" title="There are no charts of this run">
        {error}
      </Alert>
    );
  if (!value) return <Loader aria-label="Loading the charts" />;
  const { counts, speeds, shares } = value;
  const waits = counts.waiting.some((n) => n > 0);
  return (
    <>
      <Chart
        title="Road users in the network"
        xLabel="Time, s"
        yLabel="Road users"
        x={counts.time}
        series={[
          { name: "On the road", color: BLUE, values: counts.running },
          ...(waits ? [{ name: "Waiting to be inserted", color: ORANGE, values: counts.waiting }] : []),
        ]}
      >
        A line that keeps climbing means that more road users enter than leave: congestion builds up.
      </Chart>
      <Chart
        title="Arrivals"
        xLabel="Time, s"
        yLabel="Arrived so far"
        x={counts.time}
        series={[{ name: "Arrived", color: GREEN, values: counts.arrived }]}
      >
        A steady climb means that traffic flows; where the line is flat, no road user reached its goal.
      </Chart>
      <Chart
        title="Speed of vehicles"
        xLabel="Time, s"
        yLabel="km/h"
        x={speeds.time}
        series={[{ name: "Mean", color: BLUE, values: km(speeds.mean) }]}
        band={{ name: "10th to 90th percentile", low: km(speeds.low), high: km(speeds.high) }}
      >
        A wide band means that some drive freely while others wait. Stopped vehicles are included.
      </Chart>
      {shares.share.length > 0 && (
        <Chart
          title="Speed distribution"
          xLabel="Speed, km/h"
          yLabel="Share of the time, %"
          bars
          x={shares.edges.map((v) => v * 3.6)}
          series={[{ name: "Share", color: BLUE, values: shares.share.map((v) => 100 * v) }]}
        >
          A high bar on the left means much stopping and crawling; bars on the right are free flow.
        </Chart>
      )}
    </>
  );
}
