import { clock, kmh, longClock } from "../ui/words";
import type { Summary } from "../api/runs";

export interface Figure {
  label: string;
  value: string;
}

/** A figure of two runs. */
export interface Compared extends Figure {
  before: string;
  difference: string;
}

interface Known {
  label: string;
  path: string[];
  say: (value: number) => string;
  /** The size of a difference, without its sign. */
  sayDifference?: (value: number) => string;
}

const plain = (n: number): string => n.toLocaleString("en");
const seconds = (n: number): string => `${n.toFixed(1)} s`;
const KNOWN: Known[] = [
  { label: "Simulated time", path: ["sim_seconds"], say: (n) => longClock(n, n), sayDifference: seconds },
  { label: "Planned", path: ["actors", "planned"], say: plain },
  { label: "Arrived", path: ["actors", "arrived"], say: plain },
  { label: "Still on the road", path: ["actors", "running"], say: plain },
  { label: "Not inserted", path: ["actors", "waiting"], say: plain },
  { label: "In collisions", path: ["actors", "collided"], say: plain },
  { label: "Braked in an emergency", path: ["actors", "emergency_stopped"], say: plain },
  { label: "Teleported (removed after waiting)", path: ["actors", "teleported"], say: plain },
  { label: "Mean speed", path: ["figures", "mean_speed"], say: kmh, sayDifference: (n) => `${(n * 3.6).toFixed(1)} km/h` },
  { label: "Mean travel time", path: ["figures", "mean_travel_time"], say: clock, sayDifference: seconds },
  { label: "Mean delay", path: ["figures", "mean_delay"], say: seconds },
  { label: "Mean walking time", path: ["figures", "pedestrian_mean_travel_time"], say: clock, sayDifference: seconds },
];

function get(summary: Summary, path: readonly string[]): number | null {
  const found = path.reduce<unknown>(
    (at, key) => (at && typeof at === "object" ? (at as Record<string, unknown>)[key] : undefined), summary);
  return typeof found === "number" ? found : null;
}

/** The key figures of a run; those that the run has not are left out. */
export function keyFigures(summary: Summary): Figure[] {
  return KNOWN.flatMap(({ label, path, say }) => {
    const value = get(summary, path);
    return value === null ? [] : [{ label, value: say(value) }];
  });
}

/** Key figures of a run beside those of an earlier one; what neither has is left out. */
export function compared(now: Summary, before: Summary): Compared[] {
  return KNOWN.flatMap(({ label, path, say, sayDifference = say }) => {
    const [a, b] = [get(now, path), get(before, path)];
    if (a === null && b === null) return [];
    return [{
      label, value: a === null ? "–" : say(a), before: b === null ? "–" : say(b),
      difference: a === null || b === null ? "–" : signed(a - b, sayDifference),
    }];
  });
}

function signed(difference: number, say: (value: number) => string): string {
  const size = say(Math.abs(difference));
  return size === say(0) ? "same" : `${difference > 0 ? "+" : "−"}${size}`;
}

const ENDED = ["completed", "stopped", "failed", "interrupted"];
export const hasEnded = (state: string): boolean => ENDED.includes(state);

export const STATE_WORD: Record<string, string> = {
  preparing: "Preparing", running: "Running", paused: "Paused", finishing: "Writing the results",
  completed: "Finished", stopped: "Stopped", failed: "Failed", interrupted: "Interrupted",
};

export interface Speed {
  value: string;
  label: string;
  speed: number | null;
}

/** Speeds to choose from; null is as fast as the machine can. */
export const SPEEDS: Speed[] = [
  { value: "0.1", label: "0.1 ×", speed: 0.1 }, { value: "0.25", label: "0.25 ×", speed: 0.25 },
  { value: "0.5", label: "0.5 ×", speed: 0.5 }, { value: "1", label: "Real time", speed: 1 },
  { value: "2", label: "2 ×", speed: 2 }, { value: "5", label: "5 ×", speed: 5 },
  { value: "10", label: "10 ×", speed: 10 }, { value: "max", label: "As fast as possible", speed: null },
];
/** A recording has no limit but the eye. */
export const REPLAY_SPEEDS: Speed[] = SPEEDS.filter(({ speed }) => speed !== null);

export const when = (seconds1970: number): string =>
  new Date(seconds1970 * 1000).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" });
