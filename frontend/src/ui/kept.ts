import type { View } from "../map/view";

/** What of a view its address keeps, besides which view it is, so that a link shows the same. */
export interface Kept {
  /** What part of the map is in sight. */
  at?: View;
  /** The step of the editor that is open. */
  step?: string;
  /** Who is selected, or followed. */
  chosen?: readonly string[];
  /** The moment of a recording, seconds. */
  time?: number;
}

/** Milliseconds for which the address may lag behind. */
const LAG = 400;
/** Longer lists are not kept: addresses would grow too long for mail and chat. */
const MOST_CHOSEN = 30;

/** The part of an address that says which view it is. */
export const pathOf = (hash: string): string => hash.split("?")[0] ?? "";

export function parseKept(hash: string): Kept {
  const query = new URLSearchParams(hash.slice(pathOf(hash).length + 1));
  const kept: Kept = {};
  const [x, y, scale] = (query.get("at") ?? "").split(",").map(Number);
  if (x !== undefined && y !== undefined && scale !== undefined)
    if ([x, y, scale].every(Number.isFinite) && scale > 0) kept.at = { x, y, scale };
  const step = query.get("step");
  if (step) kept.step = step;
  const chosen = query.getAll("chosen");
  if (chosen.length > 0) kept.chosen = chosen;
  const time = Number(query.get("time") ?? NaN);
  if (Number.isFinite(time)) kept.time = time;
  return kept;
}

/** Inverse of {@link parseKept}, put behind the path of an address. */
export function withKept(hash: string, { at, step, chosen, time }: Kept): string {
  const query = new URLSearchParams();
  // Centimetres, and a scale that is right to a pixel in 10,000.
  if (at) query.set("at", `${at.x.toFixed(2)},${at.y.toFixed(2)},${Number(at.scale.toPrecision(5))}`);
  if (step) query.set("step", step);
  if (chosen && chosen.length <= MOST_CHOSEN) for (const id of chosen) query.append("chosen", id);
  if (time !== undefined) query.set("time", time.toFixed(1));
  const text = query.toString().replaceAll("%2C", ",");
  return text ? `${pathOf(hash)}?${text}` : pathOf(hash);
}

let pending: { path: string; kept: Kept; timer: number } | null = null;

/** Keeps something of the view in its address; the history has no entry more. */
export function keep(part: Kept): void {
  const path = pathOf(location.hash);
  if (pending && pending.path !== path) clearTimeout(pending.timer);
  const same = pending?.path === path ? pending : null;
  pending = {
    path,
    kept: { ...same?.kept, ...part },
    timer: same?.timer ?? window.setTimeout(write, LAG),
  };
  if (part.step) write(); // a form is begun at once, and the back button is near
}

/** The address with all that is to be kept, now. */
export function write(): void {
  if (!pending) return;
  const { path, kept, timer } = pending;
  clearTimeout(timer);
  pending = null;
  // Another view may have been opened meanwhile.
  if (pathOf(location.hash) !== path) return;
  const next = withKept(path, { ...parseKept(location.hash), ...kept });
  if (next !== location.hash) history.replaceState(history.state, "", next);
}
