import {
  BoxGeometry,
  CanvasTexture,
  CircleGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  SRGBColorSpace,
  Vector3,
} from "three";

import { nth } from "../lists";
import type { PackedDrawing } from "../map/drawing";
import { SIGNAL_COLOR } from "../map/colors";
import type { Head, Shown } from "../signals/heads";
import type { HeightAt, Origin } from "./ground";

const POST = new MeshLambertMaterial({ color: 0x6d757d });
/** Middle of a plate above the ground, m. */
const PLATE = 2.3;

/** Plates of signs on posts; lights stand where their heads are. */
export function signs(symbols: PackedDrawing["symbols"], [x0, y0]: Origin, height: HeightAt): Group {
  const group = new Group();
  const plates = new Map<string, MeshBasicMaterial>();
  const disc = new CircleGeometry(0.36, 24);
  const pole = new CylinderGeometry(0.035, 0.035, PLATE, 6).rotateX(Math.PI / 2).translate(0, 0, PLATE / 2);
  for (const [kind, x, y, hdg, text] of symbols) {
    if (kind.includes("light")) continue;
    const key = `${kind} ${text}`;
    const face =
      plates.get(key) ??
      new MeshBasicMaterial({ map: plate(kind, text), transparent: true, side: DoubleSide });
    plates.set(key, face);
    const [px, py] = [x - x0, y - y0];
    const post = new Mesh(pole, POST);
    post.position.set(px, py, height(px, py));
    const sign = new Mesh(disc, face);
    sign.position.set(px, py, height(px, py) + PLATE);
    // Upright first, then turned so that who comes along sees it.
    sign.rotation.set(Math.PI / 2, 0, hdg - Math.PI / 2, "ZXY");
    group.add(post, sign);
  }
  return group;
}

function plate(kind: string, text: string): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  if (context) draw(context, kind, text);
  const made = new CanvasTexture(canvas);
  made.colorSpace = SRGBColorSpace;
  return made;
}

function draw(context: CanvasRenderingContext2D, kind: string, text: string): void {
  context.translate(32, 32);
  const polygon = (corners: number, turn: number, radius: number): void => {
    context.beginPath();
    for (let k = 0; k < corners; k++) {
      const angle = turn + (2 * Math.PI * k) / corners;
      context.lineTo(radius * Math.cos(angle), radius * Math.sin(angle));
    }
    context.closePath();
  };
  context.textAlign = "center";
  context.textBaseline = "middle";
  if (kind.includes("stop")) {
    context.fillStyle = "#c1121f";
    polygon(8, Math.PI / 8, 31);
    context.fill();
    context.fillStyle = "#ffffff";
    context.font = "bold 19px sans-serif";
    context.fillText("STOP", 0, 1);
  } else if (kind.includes("yield")) {
    context.fillStyle = "#ffffff";
    context.strokeStyle = "#c1121f";
    context.lineWidth = 8;
    polygon(3, Math.PI / 2, 27);
    context.fill();
    context.stroke();
  } else {
    context.fillStyle = "#ffffff";
    context.strokeStyle = kind.includes("speed") ? "#c1121f" : "#1c5fa8";
    context.lineWidth = 7;
    polygon(32, 0, 27);
    context.fill();
    context.stroke();
    context.fillStyle = "#16191c";
    context.font = "bold 24px sans-serif";
    context.fillText(text, 0, 2);
  }
}

/** Lamps from the top down, as far as a head has them. */
const LAMPS: readonly { colors: readonly Shown[]; color: string }[] = [
  { colors: ["red"], color: SIGNAL_COLOR.red },
  { colors: ["yellow"], color: SIGNAL_COLOR.yellow },
  { colors: ["green", "permissive"], color: SIGNAL_COLOR.green },
];
/** Of the box of a head, m: above a lane, and beside a crossing. */
const OVER = { vehicle: 4.6, walk: 2.4 };
const SPACING = 0.36;
const NOTHING = new Vector3(1e-4, 1e-4, 1e-4);

/** Heads of traffic lights above their stop lines, and at the ends of crossings. */
export class Lights {
  readonly group = new Group();
  private boxes: InstancedMesh | null = null;
  private readonly lamps: InstancedMesh[] = [];

  /** Shows heads; places are made anew only where their number changes. */
  show(heads: readonly Head[], [x0, y0]: Origin, height: HeightAt): void {
    if (this.boxes?.count !== heads.length) this.make(heads.length);
    if (!this.boxes) return;
    const at = new Matrix4();
    heads.forEach(({ x, y, hdg, walk, shown }, row) => {
      const [px, py] = [x - x0, y - y0];
      const top = height(px, py) + (walk ? OVER.walk : OVER.vehicle);
      at.makeRotationZ(hdg).setPosition(px, py, top);
      this.boxes?.setMatrixAt(row, at);
      LAMPS.forEach(({ colors }, lamp) => {
        const lit = colors.includes(shown);
        // What is dark is no larger than a point, so that it is not seen.
        at.makeRotationZ(hdg);
        if (!lit) at.scale(NOTHING);
        at.setPosition(px - 0.16 * Math.cos(hdg), py - 0.16 * Math.sin(hdg), top + (1 - lamp) * SPACING);
        nth(this.lamps, lamp).setMatrixAt(row, at);
      });
    });
    this.boxes.instanceMatrix.needsUpdate = true;
    for (const lamp of this.lamps) lamp.instanceMatrix.needsUpdate = true;
  }

  private make(count: number): void {
    this.group.clear();
    for (const mesh of [this.boxes, ...this.lamps]) mesh?.dispose();
    this.lamps.length = 0;
    this.boxes = null;
    if (count === 0) return;
    this.boxes = new InstancedMesh(
      new BoxGeometry(0.22, 0.4, 1.15),
      new MeshLambertMaterial({ color: 0x16191c }),
      count,
    );
    const disc = new CircleGeometry(0.15, 16).rotateY(-Math.PI / 2);
    for (const { color } of LAMPS)
      this.lamps.push(
        new InstancedMesh(disc, new MeshBasicMaterial({ color, side: DoubleSide, fog: false }), count),
      );
    for (const mesh of [this.boxes, ...this.lamps]) {
      mesh.frustumCulled = false;
      this.group.add(mesh);
    }
  }
}
