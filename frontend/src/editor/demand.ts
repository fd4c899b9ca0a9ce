import { plural, t } from "@lingui/core/macro";

import { dayTime } from "../language/units";
import { localized } from "../language/localized";
import type { Background, Demand, Matrix, Mix, TableKind } from "../api/demand";
import { CATEGORIES } from "../api/types";
import { CATEGORY_WORD } from "../ui/words";

/** Ways to give the amount of background traffic, with what to begin with. */
export const AMOUNTS = localized(
  () =>
    [
      {
        key: "fill",
        word: t`Percent of the maximum density`,
        unit: t`Density`,
        suffix: " %",
        scale: 100,
        min: 0.1,
        max: 100,
        digits: 1,
        begin: 0.1,
      },
      {
        key: "per_km",
        word: t`Vehicles per kilometre of lane`,
        unit: t`Vehicles per kilometre`,
        suffix: "",
        scale: 1,
        min: 0.1,
        max: 200,
        digits: 1,
        begin: 5,
      },
      {
        key: "trips",
        word: t`Number of trips`,
        unit: t`Trips`,
        suffix: "",
        scale: 1,
        min: 1,
        max: 1e7,
        digits: 0,
        begin: 500,
      },
    ] as const,
);
export type Amount = ReturnType<typeof AMOUNTS>[number];

export const amountOf = (one: Background): Amount =>
  AMOUNTS().find(({ key }) => one[key] !== null) ?? AMOUNTS()[0];

/** Whether the demand of a scenario has trips to make. */
export const bringsTraffic = ({ inputs, matrices, counts, background }: Demand): boolean =>
  inputs.length + matrices.length + counts.length + background.length > 0;

export const tripsOf = (matrix: Matrix): number =>
  matrix.trips.reduce((sum, [, , number]) => sum + number, 0);

/** What a scenario's traffic is, in a line. */
export function trafficNote(demand: Demand): string {
  const { inputs, matrices, counts, background } = demand;
  if (!bringsTraffic(demand)) return t`Who else is on the road?`;
  const trips = Math.round(matrices.reduce((sum, one) => sum + tripsOf(one), 0));
  const counted = counts.reduce((sum, one) => sum + one.rows.length, 0);
  return [
    ...(inputs.length ? [plural(inputs.length, { one: "# vehicle input", other: "# vehicle inputs" })] : []),
    ...(matrices.length ? [plural(trips, { one: "# trip", other: "# trips" })] : []),
    ...(counts.length ? [plural(counted, { one: "# count", other: "# counts" })] : []),
    ...(background.length ? [t`background traffic`] : []),
  ].join(", ");
}

/** A mix in words, the largest share first. */
export function mixWords(mix: Mix): string {
  const total = Object.values(mix).reduce((sum, share) => sum + share, 0);
  return CATEGORIES.filter((one) => mix[one])
    .sort((a, b) => (mix[b] ?? 0) - (mix[a] ?? 0))
    .map((one) => `${CATEGORY_WORD()[one]} ${Math.round((100 * (mix[one] ?? 0)) / total)} %`)
    .join(", ");
}

/** A name that no part of the demand has yet. */
export function freeName(demand: Demand, stem: string): string {
  const taken = new Set(
    [demand.zones, demand.profiles, demand.inputs, demand.matrices, demand.counts, demand.background]
      .flat()
      .map(({ id }) => id),
  );
  for (let n = 1; ; n++) {
    const name = n === 1 ? stem : `${stem}-${n}`;
    if (!taken.has(name)) return name;
  }
}

/** Time of day as a field shows it: `07:05`. */
export function timeOfDay(seconds: number): string {
  const minutes = Math.floor(seconds / 60) % (24 * 60);
  return `${String(Math.floor(minutes / 60)).padStart(2, "0")}:${String(minutes % 60).padStart(2, "0")}`;
}

/** Inverse of {@link timeOfDay}; null for what is no time. */
export function secondsOfDay(text: string): number | null {
  const found = /^(\d{1,2}):(\d{2})$/.exec(text);
  const seconds = found ? Number(found[1]) * 3600 + Number(found[2]) * 60 : Infinity;
  return seconds < 86_400 ? seconds : null;
}

/** When traffic is highest and lowest. */
export function peakWords(shares: readonly number[]): string {
  const at = (n: number): string => dayTime((n * 86_400) / shares.length);
  const [most, fewest] = [shares.indexOf(Math.max(...shares)), shares.indexOf(Math.min(...shares))];
  return t`most trips from ${at(most)}, fewest from ${at(fewest)}`;
}

/** What a table looks like, with roads of the scenario's own; it can be read in as it is. */
export function exampleTable(kind: TableKind, demand: Demand, roads: readonly string[]): string {
  const [a, b] = [roads[0] ?? "r1", roads[1] ?? roads[0] ?? "r2"];
  const start = demand.clock;
  const slice = (n: number): string => `${timeOfDay(start + 900 * n)},${timeOfDay(start + 900 * (n + 1))}`;
  const rows: Record<TableKind, string[]> = {
    od: ["from,to,trips", `${a},${b},120`, `${b},${a},90`],
    counts: ["place,begin,end,count", `${a},${slice(0)},48`, `${a},${slice(1)},55`],
    inputs: [
      `segment,${timeOfDay(start)},${timeOfDay(start + 900)},${timeOfDay(start + 1800)}`,
      `${a},110,125,140`,
    ],
    profile: ["time,share", "0:00,1", "6:00,6", "12:00,5", "18:00,3"],
    office: ["station;time;cars", `${a};${timeOfDay(start)};48`, `${a};${timeOfDay(start + 900)};55`],
    zones: ["zone,segment", `centre,${a}`, ...(b === a ? [] : [`centre,${b}`])],
  };
  return `${rows[kind].join("\n")}\n`;
}
