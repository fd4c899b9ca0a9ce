import {
  AdditiveBlending,
  type BufferGeometry,
  Color,
  type Frustum,
  Group,
  InstancedMesh,
  type Material,
  Matrix4,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Quaternion,
  Sphere,
  Vector3,
} from "three";

import { CATEGORIES } from "../api/types";
import { nth } from "../lists";
import { CATEGORY_COLOR } from "../map/colors";
import { FLAG_BRAKE, FLAG_LEFT, FLAG_RIGHT } from "../map/movingLayer";
import type { Moving } from "../map/scene";
import { body, brakeLamps, farBody, HEIGHT, headLamps, indicators, lightPool } from "./bodies";
import type { Carried } from "./cameras";
import type { Origin } from "./ground";
import type { Heights } from "./heights";

const [UP, ACROSS] = [new Vector3(0, 0, 1), new Vector3(0, 1, 0)];
/** Pixels of a length from which on a body has wheels, windows and lamps. */
const DETAILED = 18;
/** How far lamps light up the road, m. */
const POOL = 25;
const RIDDEN = new Set(["bicycle", "pedestrian"]);

/** Many bodies of one shape, as many as there are at the moment. */
class Bodies {
  private mesh: InstancedMesh | null = null;
  private rows = 0;

  constructor(
    private readonly group: Group,
    private readonly shape: BufferGeometry,
    private readonly look: Material,
  ) {}

  begin(most: number): void {
    this.rows = 0;
    if (this.mesh && this.mesh.instanceMatrix.count >= most) return;
    if (most === 0) return;
    this.mesh?.removeFromParent();
    this.mesh?.dispose();
    this.mesh = new InstancedMesh(this.shape, this.look, Math.ceil(most * 1.5) + 8);
    this.mesh.frustumCulled = false; // bounds of instances are not those of the shape
    this.group.add(this.mesh);
  }

  add(at: Matrix4, color?: Color): void {
    this.mesh?.setMatrixAt(this.rows, at);
    if (color) this.mesh?.setColorAt(this.rows, color);
    this.rows += 1;
  }

  end(): void {
    if (!this.mesh) return;
    this.mesh.count = this.rows;
    for (const sent of [this.mesh.instanceMatrix, this.mesh.instanceColor]) {
      if (!sent) continue;
      sent.clearUpdateRanges();
      sent.addUpdateRange(0, this.rows * sent.itemSize);
      sent.needsUpdate = this.rows > 0;
    }
  }
}

/** What a camera sees. */
export interface Sight {
  frustum: Frustum;
  eye: Vector3;
  /** Pixels of a metre that is a metre away. */
  span: number;
}

/** All road users of a moment, as bodies with lamps. */
export class CrowdOfBodies {
  readonly group = new Group();
  /** Whether lamps are on. */
  dark = false;
  private readonly bodies: readonly Bodies[];
  /** What is too far away for details. */
  private readonly far: Bodies;
  private readonly lamps: Record<"brake" | "left" | "right" | "front" | "pool", Bodies>;
  private readonly colors = new Map<string, Color>();
  /** The moment that was shown last, and where its road users are. */
  private moving: Moving | null = null;
  private placed: (Carried | undefined)[] = [];

  constructor(
    private readonly origin: Origin,
    private readonly heights: Heights,
  ) {
    const painted = new MeshLambertMaterial({ vertexColors: true });
    const glowing = (color: number): MeshBasicMaterial => new MeshBasicMaterial({ color });
    this.bodies = CATEGORIES.map((category) => new Bodies(this.group, body(category), painted));
    // From afar a pixel of the road is longer than a body is high: bodies lie above all coats of paint.
    const lifted = { polygonOffset: true, polygonOffsetFactor: -6, polygonOffsetUnits: -40 };
    this.far = new Bodies(this.group, farBody(), new MeshLambertMaterial({ vertexColors: true, ...lifted }));
    const mirrored = indicators().scale(1, -1, 1);
    mirrored.setIndex([...Array(mirrored.getAttribute("position").count).keys()].reverse());
    this.lamps = {
      brake: new Bodies(this.group, brakeLamps(), glowing(0xff2a1f)),
      left: new Bodies(this.group, indicators(), glowing(0xffa21a)),
      right: new Bodies(this.group, mirrored, glowing(0xffa21a)),
      front: new Bodies(this.group, headLamps(), glowing(0xfff6dd)),
      pool: new Bodies(
        this.group,
        lightPool(),
        new MeshBasicMaterial({
          vertexColors: true,
          blending: AdditiveBlending,
          transparent: true,
          opacity: 0.35,
          depthWrite: false,
        }),
      ),
    };
  }

  /** Places all of a moment that a camera sees; `hidden` is the row of who looks out of its own eyes, or -1. */
  show(moving: Moving, hidden: number, { frustum, eye, span }: Sight): void {
    if (this.moving !== moving) {
      this.moving = moving;
      this.placed = new Array<Carried | undefined>(moving.count);
    }
    const all = [...this.bodies, this.far, ...Object.values(this.lamps)];
    for (const one of all) one.begin(moving.count);
    const { group, colors } = moving.tint ?? { group: moving.category, colors: KIND_COLORS };
    const at = new Matrix4();
    const ball = new Sphere();
    const { lowest, highest } = this.heights;
    // With what its lamps light up.
    const beyond = (highest - lowest) / 2 + (this.dark ? POOL : HEIGHT.truck);
    for (let row = 0; row < moving.count; row++) {
      if (row === hidden) continue;
      const [x, y, length] = [0, 1, 3].map((k) => nth(moving.pose, 5 * row + k)) as [number, number, number];
      // Where it is on the ground takes longer to find than whether it can be in sight.
      ball.center.set(x - this.origin[0], y - this.origin[1], (lowest + highest) / 2);
      ball.radius = length + beyond;
      if (!frustum.intersectsSphere(ball)) continue;
      const who = (this.placed[row] ??= this.carried(moving, row));
      const detailed = who.length * span > DETAILED * ball.center.distanceTo(eye);
      (detailed ? nth(this.bodies, nth(moving.category, row)) : this.far).add(
        placed(at, who, who.length, who.width, HEIGHT[who.category]),
        this.color(nth(colors, nth(group, row))),
      );
      if (!RIDDEN.has(who.category)) this.addLamps(at, who, detailed ? nth(moving.flags, row) : 0);
    }
    for (const one of all) one.end();
  }

  /** A road user of a moment with its height and slope, in metres of the scene. */
  carried({ pose, category }: Moving, row: number): Carried {
    const [x, y, hdg, length, width] = [0, 1, 2, 3, 4].map((k) => nth(pose, 5 * row + k)) as [
      number,
      number,
      number,
      number,
      number,
    ];
    const { z, east, north } = this.heights.plane(x, y, { hdg });
    return {
      x: x - this.origin[0],
      y: y - this.origin[1],
      z,
      hdg,
      slope: east * Math.cos(hdg) + north * Math.sin(hdg),
      length,
      width,
      category: nth(CATEGORIES, nth(category, row)),
    };
  }

  private addLamps(at: Matrix4, who: Carried, flags: number): void {
    // `at` is where the body is still.
    if (flags & FLAG_BRAKE) this.lamps.brake.add(at);
    if (flags & FLAG_LEFT) this.lamps.left.add(at);
    if (flags & FLAG_RIGHT) this.lamps.right.add(at);
    if (!this.dark) return;
    this.lamps.front.add(at);
    const [cos, sin] = [Math.cos(who.hdg), Math.sin(who.hdg)];
    const nose = { ...who, x: who.x + (who.length / 2) * cos, y: who.y + (who.length / 2) * sin };
    nose.z += (who.length / 2) * who.slope;
    this.lamps.pool.add(placed(at, nose, 1, 1, 1));
  }

  private color(text: string): Color {
    const found = this.colors.get(text) ?? new Color(text);
    this.colors.set(text, found);
    return found;
  }
}

const KIND_COLORS = CATEGORIES.map((category) => CATEGORY_COLOR[category]);

function placed(
  at: Matrix4,
  { x, y, z, hdg, slope }: Carried,
  length: number,
  width: number,
  height: number,
): Matrix4 {
  const turn = new Quaternion().setFromAxisAngle(UP, hdg);
  if (slope) turn.multiply(new Quaternion().setFromAxisAngle(ACROSS, -Math.atan(slope)));
  return at.compose(new Vector3(x, y, z), turn, new Vector3(length, width, height));
}
