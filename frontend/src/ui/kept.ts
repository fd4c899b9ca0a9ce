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
  /** What the colours of road users say. */
  by?: string;
  /** What those of lanes say, and of which part of a run. */
  lanes?: string;
  /** From where it is looked at in three dimensions. */
  camera?: string;
  /** Further views of the same, in their order; the first one is described above. */
  others?: readonly KeptView[];
}

/** One of several views. */
export interface KeptView {
  at?: View;
  followed?: string;
  by?: string;
  lanes?: string;
  camera?: string;
}

/** Milliseconds for which the address may lag behind. */
const LAG = 400;
/** Longer lists are not kept: addresses would grow too long for mail and chat. */
const MOST_CHOSEN = 30;
/** Views that a link can ask for: no reader can look at more. */
const MOST_OTHERS = 8;

/** The part of an address that says which view it is. */
export const pathOf = (hash: string): string => hash.split("?")[0] ?? "";

export function parseKept(hash: string): Kept {
  const query = new URLSearchParams(hash.slice(pathOf(hash).length + 1));
  const kept: Kept = {};
  const at = parsePlace(query.get("at"));
  if (at) kept.at = at;
  const step = query.get("step");
  if (step) kept.step = step;
  const chosen = query.getAll("chosen");
  if (chosen.length > 0) kept.chosen = chosen;
  const time = Number(query.get("time") ?? NaN);
  if (Number.isFinite(time)) kept.time = time;
  const by = query.get("by");
  if (by) kept.by = by;
  const lanes = query.get("lanes");
  if (lanes) kept.lanes = lanes;
  const camera = query.get("camera");
  if (camera) kept.camera = camera;
  const others: KeptView[] = [];
  for (let n = 2; n < 2 + MOST_OTHERS && query.has(`at${n}`); n++) {
    const place = parsePlace(query.get(`at${n}`));
    const [followed, colours, lanes, camera] = ["chosen", "by", "lanes", "camera"].map((key) =>
      query.get(`${key}${n}`),
    );
    others.push({
      ...(place && { at: place }),
      ...(followed && { followed }),
      ...(colours && { by: colours }),
      ...(lanes && { lanes }),
      ...(camera && { camera }),
    });
  }
  if (others.length > 0) kept.others = others;
  return kept;
}

function parsePlace(text: string | null): View | null {
  const [x, y, scale] = (text ?? "").split(",").map(Number);
  if (x === undefined || y === undefined || scale === undefined) return null;
  return [x, y, scale].every(Number.isFinite) && scale > 0 ? { x, y, scale } : null;
}

/** Centimetres, and a scale that is right to a pixel in 10,000. */
const placeText = ({ x, y, scale }: View): string =>
  `${x.toFixed(2)},${y.toFixed(2)},${Number(scale.toPrecision(5))}`;

/** Inverse of {@link parseKept}, put behind the path of an address. */
export function withKept(
  hash: string,
  { at, step, chosen, time, by, lanes, camera, others = [] }: Kept,
): string {
  const query = new URLSearchParams();
  if (at) query.set("at", placeText(at));
  if (step) query.set("step", step);
  if (chosen && chosen.length <= MOST_CHOSEN) for (const id of chosen) query.append("chosen", id);
  if (time !== undefined) query.set("time", time.toFixed(1));
  if (by) query.set("by", by);
  if (lanes) query.set("lanes", lanes);
  if (camera) query.set("camera", camera);
  others.forEach((other, k) => {
    // Also without a place it is there.
    query.set(`at${k + 2}`, other.at ? placeText(other.at) : "");
    if (other.followed) query.set(`chosen${k + 2}`, other.followed);
    if (other.by) query.set(`by${k + 2}`, other.by);
    if (other.lanes) query.set(`lanes${k + 2}`, other.lanes);
    if (other.camera) query.set(`camera${k + 2}`, other.camera);
  });
  const text = query.toString().replaceAll("%2C", ",");
  return text ? `${pathOf(hash)}?${text}` : pathOf(hash);
}

/** What views were left with, by their paths: one that is opened again is as it was. */
const left = new Map<string, Kept>();

/** Gives an address that asks for nothing what its view was left with. */
function restore(): void {
  if (pending && pending.path !== pathOf(location.hash)) write();
  const kept = left.get(location.hash);
  if (kept) history.replaceState(history.state, "", withKept(location.hash, kept));
}
// Before any view reads the address.
if (typeof addEventListener === "function") addEventListener("hashchange", restore);

/** The address of a view that is opened with something in sight, and what was kept of it besides. */
export const openedWith = (hash: string, kept: Kept): string =>
  withKept(hash, { ...left.get(hash), ...kept });

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
  const there = pathOf(location.hash) === path ? parseKept(location.hash) : left.get(path);
  left.set(path, { ...there, ...kept });
  // Another view may have been opened meanwhile.
  if (pathOf(location.hash) !== path) return;
  const next = withKept(path, { ...there, ...kept });
  if (next !== location.hash) history.replaceState(history.state, "", next);
}

/** Keeps what part of a map is in sight. */
export interface KeptPlace {
  read: () => View | undefined;
  write: (at: View) => void;
}

/** Of a map that is alone in its page. */
export const IN_ADDRESS: KeptPlace = {
  read: () => parseKept(location.hash).at,
  write: (at) => keep({ at }),
};
