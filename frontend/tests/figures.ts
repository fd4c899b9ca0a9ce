import type { FigureInfo } from "../src/api/figures";

const figure = (
  name: string,
  part: FigureInfo["part"],
  label: string,
  better: FigureInfo["better"],
  display: Partial<FigureInfo["display"]> = {},
): FigureInfo => ({
  name,
  part,
  label,
  better,
  unit: "",
  definition: "",
  source: "",
  on_page: true,
  display: { unit: "", factor: 1, digits: 0, clock: false, ...display },
});

/** Some figures as the server describes them. */
export const FIGURES: FigureInfo[] = [
  figure("sim_seconds", "", "simulated time", "neither", { unit: "s", digits: 1, clock: true }),
  { ...figure("planned", "actors", "road users planned", "neither"), on_page: false },
  figure("arrived", "actors", "arrived", "higher"),
  figure("collided", "actors", "in collisions", "lower"),
  figure("mean_speed", "figures", "mean speed", "higher", { unit: "km/h", factor: 3.6, digits: 1 }),
  figure("mean_delay", "figures", "mean delay", "lower", { unit: "s", digits: 1, clock: true }),
];
