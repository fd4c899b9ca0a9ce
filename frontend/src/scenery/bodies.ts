import { BufferAttribute, BufferGeometry, Color } from "three";

import type { Category } from "../api/types";

/** Heights of bodies, m. */
export const HEIGHT: Record<Category, number> = {
  car: 1.5,
  van: 2.1,
  truck: 3.4,
  bus: 3.1,
  motorcycle: 1.5,
  bicycle: 1.7,
  pedestrian: 1.75,
};

/** What takes the colour of who it is. */
const PAINT = 0xffffff;
const GLASS = 0x2a3642;
const TYRE = 0x1b1b1b;
const SKIN = 0xc99a78;
const CLOTH = 0x39424e;

/** A box, tapered upwards: from, to along each axis in shares of length, width and height. */
interface Part {
  color: number;
  x: readonly [number, number];
  y: readonly [number, number];
  z: readonly [number, number];
  /** How far the top is drawn in at rear, front and each side, in the same shares. */
  taper?: readonly [rear: number, front: number, side: number];
}

const wheels = (rear: number, front: number, radius: number): Part[] =>
  [rear, front].map((at) => ({
    color: TYRE,
    x: [at - radius, at + radius],
    y: [-0.5, 0.5],
    z: [0, 0.32],
  }));

const PARTS: Record<Category, readonly Part[]> = {
  car: [
    ...wheels(-0.3, 0.3, 0.07),
    { color: PAINT, x: [-0.5, 0.5], y: [-0.48, 0.48], z: [0.14, 0.58], taper: [0.01, 0.03, 0.03] },
    { color: GLASS, x: [-0.42, 0.26], y: [-0.44, 0.44], z: [0.58, 0.96], taper: [0.1, 0.14, 0.07] },
    { color: PAINT, x: [-0.32, 0.12], y: [-0.37, 0.37], z: [0.96, 1] },
  ],
  van: [
    ...wheels(-0.3, 0.32, 0.07),
    { color: PAINT, x: [-0.5, 0.5], y: [-0.5, 0.5], z: [0.12, 0.5], taper: [0, 0.02, 0.01] },
    { color: PAINT, x: [-0.5, 0.22], y: [-0.49, 0.49], z: [0.5, 1], taper: [0.01, 0.02, 0.05] },
    { color: GLASS, x: [0.22, 0.47], y: [-0.47, 0.47], z: [0.5, 0.97], taper: [0, 0.2, 0.05] },
  ],
  truck: [
    ...wheels(-0.34, 0.36, 0.06),
    { color: CLOTH, x: [-0.5, 0.5], y: [-0.42, 0.42], z: [0.14, 0.28] },
    { color: 0xd6dade, x: [-0.5, 0.26], y: [-0.5, 0.5], z: [0.28, 1] },
    { color: PAINT, x: [0.29, 0.5], y: [-0.49, 0.49], z: [0.16, 0.82], taper: [0, 0.02, 0.02] },
    { color: GLASS, x: [0.42, 0.503], y: [-0.44, 0.44], z: [0.5, 0.74] },
  ],
  bus: [
    ...wheels(-0.3, 0.34, 0.05),
    { color: PAINT, x: [-0.5, 0.5], y: [-0.5, 0.5], z: [0.1, 0.45] },
    { color: GLASS, x: [-0.5, 0.503], y: [-0.503, 0.503], z: [0.45, 0.85] },
    { color: PAINT, x: [-0.5, 0.5], y: [-0.5, 0.5], z: [0.85, 1] },
  ],
  motorcycle: [
    { color: TYRE, x: [-0.5, -0.2], y: [-0.1, 0.1], z: [0, 0.4] },
    { color: TYRE, x: [0.2, 0.5], y: [-0.1, 0.1], z: [0, 0.4] },
    { color: PAINT, x: [-0.3, 0.35], y: [-0.2, 0.2], z: [0.25, 0.6] },
    { color: CLOTH, x: [-0.2, 0.08], y: [-0.4, 0.4], z: [0.5, 0.88], taper: [0, 0, 0.08] },
    { color: PAINT, x: [-0.12, 0.06], y: [-0.17, 0.17], z: [0.86, 1] },
  ],
  bicycle: [
    { color: TYRE, x: [-0.5, -0.14], y: [-0.05, 0.05], z: [0, 0.36] },
    { color: TYRE, x: [0.14, 0.5], y: [-0.05, 0.05], z: [0, 0.36] },
    { color: PAINT, x: [-0.3, 0.3], y: [-0.06, 0.06], z: [0.3, 0.45] },
    { color: PAINT, x: [-0.2, 0.08], y: [-0.36, 0.36], z: [0.48, 0.85], taper: [0, 0, 0.08] },
    { color: SKIN, x: [-0.1, 0.06], y: [-0.18, 0.18], z: [0.85, 1] },
  ],
  pedestrian: [
    { color: CLOTH, x: [-0.3, 0.3], y: [-0.3, 0.3], z: [0, 0.48] },
    { color: PAINT, x: [-0.4, 0.4], y: [-0.48, 0.48], z: [0.48, 0.84], taper: [0.08, 0.08, 0.1] },
    { color: SKIN, x: [-0.25, 0.25], y: [-0.22, 0.22], z: [0.86, 1] },
  ],
};

/** A body of one metre in each direction, its middle on the ground at the origin, looking along x. */
export const body = (category: Category): BufferGeometry => boxes(PARTS[category]);

/** The same from far away. */
export const farBody = (): BufferGeometry =>
  boxes([{ color: PAINT, x: [-0.5, 0.5], y: [-0.5, 0.5], z: [0, 1], taper: [0.06, 0.1, 0.06] }]);

/** Lamps at the rear, lit while it brakes. */
export const brakeLamps = (): BufferGeometry =>
  boxes([-1, 1].map((side) => ({ color: PAINT, x: [-0.515, -0.49], y: span(side), z: [0.38, 0.52] })));

/** Indicators of the left side; those of the right are their mirror image. */
export const indicators = (): BufferGeometry =>
  boxes(
    [
      [-0.51, -0.46],
      [0.46, 0.51],
    ].map(([from = 0, to = 0]) => ({ color: PAINT, x: [from, to], y: [0.4, 0.515], z: [0.28, 0.4] })),
  );

/** Lamps at the front, lit at night. */
export const headLamps = (): BufferGeometry =>
  boxes([-1, 1].map((side) => ({ color: PAINT, x: [0.48, 0.515], y: span(side), z: [0.3, 0.44] })));

const span = (side: number): [number, number] => (side < 0 ? [-0.46, -0.28] : [0.28, 0.46]);

/** What they light up of the road, in metres ahead of a front at the origin. */
export function lightPool(): BufferGeometry {
  const made = new BufferGeometry();
  const places = [
    0.5, 0.7, 0.04, 0.5, -0.7, 0.04, 22, -3.6, 0.04, 0.5, 0.7, 0.04, 22, -3.6, 0.04, 22, 3.6, 0.04,
  ];
  const bright = [1, 1, 0, 1, 0, 0].flatMap((share) => [share, share * 0.95, share * 0.8]);
  made.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  made.setAttribute("color", new BufferAttribute(new Float32Array(bright), 3));
  return made;
}

/** Corners of a box by the bits of their number: front, left, top. */
const FACES = [
  [1, 3, 7, 5],
  [2, 0, 4, 6],
  [3, 2, 6, 7],
  [0, 1, 5, 4],
  [4, 5, 7, 6],
] as const;

function boxes(parts: readonly Part[]): BufferGeometry {
  const [places, colors]: [number[], number[]] = [[], []];
  for (const { color, x, y, z, taper = [0, 0, 0] } of parts) {
    const { r, g, b } = new Color(color);
    const corner = (bits: number): [number, number, number] => {
      const [front, left, top] = [bits & 1, bits & 2, bits & 4];
      const [rear, ahead, side] = top ? taper : [0, 0, 0];
      return [front ? x[1] - ahead : x[0] + rear, left ? y[1] - side : y[0] + side, top ? z[1] : z[0]];
    };
    for (const [p, q, r2, s] of FACES)
      for (const bits of [p, q, r2, p, r2, s]) {
        places.push(...corner(bits));
        colors.push(r, g, b);
      }
  }
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  made.setAttribute("color", new BufferAttribute(new Float32Array(colors), 3));
  made.computeVertexNormals();
  return made;
}
