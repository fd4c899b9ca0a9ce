import type { SceneActor } from "./scene";

/** Pixels from which the body of a road user is seen as one; a shorter one has a badge with its kind. */
const BODY_FROM = 10;
/** Pixels between the middles of badges, so that none hides another. */
export const BADGE_ROOM = 24;
/** More than these are dots while the whole map is in sight, unless one looks at them. */
const MANY = 300;
/** Pixels per metre from which there are bodies of cars, beside which the badges are small. */
const SMALL_FROM = 2.6;
const RADIUS = 12;
const SMALL_RADIUS = 7;

/** How a road user is drawn, and where on the screen. */
export interface Marker {
  actor: SceneActor;
  x: number;
  y: number;
  look: "body" | "badge" | "dot";
}

/** Radius of badges in pixels, at so many pixels per metre. */
export const badgeRadius = (scale: number): number => (scale < SMALL_FROM ? RADIUS : SMALL_RADIUS);

/** Whether one looks at a road user: it never becomes a dot. */
const important = ({ selected, ego, problem }: SceneActor): boolean => selected || ego || problem;

/**
 * How each road user is drawn at a scale, pixels per metre, in the order of drawing.
 *
 * A sign with the kind is on a road user or in its place, never above it, where it would hide the one on the next
 * lane; of those whose badges would hide each other, the later ones are dots.
 */
export function markers(
  actors: readonly SceneActor[],
  at: (x: number, y: number) => [number, number],
  scale: number,
): Marker[] {
  const plain = actors.length > MANY && scale < SMALL_FROM;
  const room = scale < SMALL_FROM ? BADGE_ROOM : 2 * SMALL_RADIUS;
  const cells = new Map<string, [number, number][]>();
  const cell = (v: number): number => Math.floor(v / room);
  const free = (x: number, y: number): boolean => {
    for (let i = cell(x) - 1; i <= cell(x) + 1; i++)
      for (let j = cell(y) - 1; j <= cell(y) + 1; j++)
        if (cells.get(`${i} ${j}`)?.some(([u, v]) => Math.hypot(u - x, v - y) < room)) return false;
    return true;
  };
  const put = (x: number, y: number): void => {
    const key = `${cell(x)} ${cell(y)}`;
    const there = cells.get(key);
    if (there) there.push([x, y]);
    else cells.set(key, [[x, y]]);
  };
  const found = [...actors.filter(important), ...actors.filter((one) => !important(one))].map(
    (actor): Marker => {
      const [x, y] = at(actor.x, actor.y);
      if (actor.length * scale > BODY_FROM) return { actor, x, y, look: "body" };
      if (!important(actor) && (plain || !free(x, y))) return { actor, x, y, look: "dot" };
      put(x, y);
      return { actor, x, y, look: "badge" };
    },
  );
  const rank = ({ actor, look }: Marker): number =>
    (look === "dot" ? 0 : look === "body" ? 1 : 2) + (important(actor) ? 3 : 0);
  return found.sort((a, b) => rank(a) - rank(b));
}
