import { clock, kmh } from "../ui/words";

export interface Figure {
  label: string;
  value: string;
}

const get = (summary: unknown, ...path: string[]): unknown =>
  path.reduce<unknown>((at, key) => (at && typeof at === "object" ? (at as Record<string, unknown>)[key] : undefined), summary);

/** The key figures of a run in plain words; those that the run has not are left out. */
export function keyFigures(summary: Record<string, unknown>): Figure[] {
  const found: Figure[] = [];
  const put = (label: string, value: unknown, say: (n: number) => string): void => {
    if (typeof value === "number") found.push({ label, value: say(value) });
  };
  const plain = (n: number): string => n.toLocaleString("en");
  const seconds = (n: number): string => `${n.toFixed(1)} s`;
  put("Simulated time", get(summary, "sim_seconds"), clock);
  put("Planned", get(summary, "actors", "planned"), plain);
  put("Arrived", get(summary, "actors", "arrived"), plain);
  put("Still on the way", get(summary, "actors", "running"), plain);
  put("Never got on the road", get(summary, "actors", "waiting"), plain);
  put("In collisions", get(summary, "actors", "collided"), plain);
  put("Had to brake hard", get(summary, "actors", "emergency_stopped"), plain);
  put("Mean speed", get(summary, "figures", "mean_speed"), kmh);
  put("Mean trip", get(summary, "figures", "mean_travel_time"), clock);
  put("Mean delay", get(summary, "figures", "mean_delay"), seconds);
  put("Mean walk", get(summary, "figures", "pedestrian_mean_travel_time"), clock);
  return found;
}

const ENDED = ["completed", "stopped", "failed", "interrupted"];
export const hasEnded = (state: string): boolean => ENDED.includes(state);

export const STATE_WORD: Record<string, string> = {
  preparing: "Getting ready", running: "Running", paused: "Paused", finishing: "Writing the results",
  completed: "Finished", stopped: "Stopped", failed: "Failed", interrupted: "Interrupted",
};

/** Speeds to choose from; null is as fast as the machine can. */
export const SPEEDS: { value: string; label: string; speed: number | null }[] = [
  { value: "0.1", label: "0.1 ×", speed: 0.1 }, { value: "0.5", label: "0.5 ×", speed: 0.5 },
  { value: "1", label: "Real time", speed: 1 }, { value: "2", label: "2 ×", speed: 2 },
  { value: "5", label: "5 ×", speed: 5 }, { value: "10", label: "10 ×", speed: 10 },
  { value: "max", label: "As fast as it can", speed: null },
];
