import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  FogExp2,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { MapControls } from "three/addons/controls/MapControls.js";

import type { Bounds } from "../api/types";
import { LIGHT } from "../map/colors";
import type { PackedDrawing, PackedLines } from "../map/drawing";
import type { Moving } from "../map/scene";
import type { Size, View } from "../map/view";
import type { Head } from "../signals/heads";
import { above, ANGLE, behind, type Camera, seat } from "./cameras";
import { CrowdOfBodies } from "./crowd";
import { blocks, type HeightAt, type Origin, ribbons, surface, withUpNormals } from "./ground";
import type { Heights } from "./heights";
import { Lights, signs } from "./signs";
import { skyOf, type Sky } from "./weather";

/** Metres between paint and what it lies on, so that it is not lost in it from afar. */
const COAT = 0.015;
/** Width of a stop line, m. */
const STOP_LINE = 0.4;
/** Of a building whose height the map does not draw, m. */
const STOREYS = [6, 9, 12];
/** Cells along the longer side of the land around roads. */
const LAND_CELLS = 120;
const DROPS = 900;
const TILT = Math.PI / 2 - 0.05;

/** A map and its road users in three dimensions; drawn when something has changed. */
export class Scenery {
  readonly canvas: HTMLCanvasElement;
  /** How often something was drawn, and for how many milliseconds the page was busy with it. */
  readonly stats = { frames: 0, busy: 0 };
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(ANGLE.above, 1, 0.4, 6000);
  private readonly controls: MapControls;
  private readonly origin: Origin;
  private readonly crowd: CrowdOfBodies;
  private readonly lights = new Lights();
  private readonly around = new HemisphereLight(0xffffff, 0x8a8f80, 1.6);
  private readonly glow = new AmbientLight(0xffffff, 0.2);
  private readonly sun = new DirectionalLight(0xffffff, 2);
  private readonly rain = drops();
  private readonly roads: MeshLambertMaterial[] = [];
  private moving: Moving | null = null;
  private mode: Camera = "above";
  private size: Size = { width: 1, height: 1 };
  private readonly ratio: number;
  private pending = 0;

  constructor(
    host: HTMLElement,
    drawing: PackedDrawing,
    private readonly heights: Heights,
    pixelRatio: number,
  ) {
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.ratio = pixelRatio;
    this.canvas = this.renderer.domElement;
    host.append(this.canvas);
    const [x0, y0, x1, y1] = drawing.bounds;
    this.origin = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.crowd = new CrowdOfBodies(this.origin, heights);
    this.camera.up.set(0, 0, 1);
    this.controls = new MapControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = TILT;
    this.controls.minDistance = 3;
    this.controls.maxDistance = 4000;
    this.controls.addEventListener("change", () => this.mark());
    this.scene.add(this.around, this.glow, this.sun, this.sun.target);
    this.build(drawing);
    this.scene.add(this.crowd.group, this.lights.group, this.rain);
    this.setWeather({});
  }

  setSize(size: Size): void {
    this.size = size;
    this.resize();
  }

  setWeather(values: Readonly<Record<string, number>>): void {
    const sky: Sky = skyOf(values);
    this.scene.background = sky.color;
    this.scene.fog = new FogExp2(sky.color, sky.fog);
    this.around.color = sky.color.clone().lerp(new Color(0xffffff), 0.6);
    this.around.intensity = sky.ambient;
    this.glow.intensity = sky.dark ? 0.55 : 0.15;
    this.sun.color = sky.sunColor;
    this.sun.intensity = sky.sun;
    this.sun.position.set(...sky.towards).multiplyScalar(100);
    this.crowd.dark = sky.dark;
    this.rain.visible = sky.rain > 0.05;
    this.rain.geometry.setDrawRange(0, 2 * Math.round(DROPS * sky.rain));
    // Water makes a road darker.
    for (const road of this.roads) road.color.set(ROAD).multiplyScalar(1 - 0.4 * sky.wet);
    this.showCrowd();
  }

  setMoving(moving: Moving | null): void {
    this.moving = moving;
    this.showCrowd();
  }

  setHeads(heads: readonly Head[]): void {
    this.lights.show(heads, this.origin, this.heightAt());
    this.mark();
  }

  /** From where one looks from now on. */
  setCamera(mode: Camera): void {
    this.mode = mode;
    this.controls.enabled = mode === "above";
    this.camera.fov = ANGLE[mode];
    this.camera.updateProjectionMatrix();
    this.showCrowd();
  }

  /** Looks at the same part of the map as a plan does, from so steep above; 0 is straight down. */
  lookAt({ x, y, scale }: View, tilt: number): void {
    const { eye, target } = above(
      [...this.local(x, y), this.heights.at(x, y)],
      scale,
      this.size.height,
      tilt,
    );
    this.controls.target.set(...target);
    this.camera.position.set(...eye);
    this.camera.lookAt(...target);
    this.controls.update();
    this.mark();
  }

  /** Nearer, or further away. */
  zoom(factor: number): void {
    const { target } = this.controls;
    this.camera.position.sub(target).divideScalar(factor).add(target);
    this.controls.update();
    this.mark();
  }

  /** Moves along the ground, by shares of how far away it is: to the right and ahead. */
  pan(aside: number, ahead: number): void {
    const { target } = this.controls;
    const far = this.camera.position.distanceTo(target);
    const forward = new Vector3().subVectors(target, this.camera.position).setZ(0).normalize();
    const step = new Vector3(forward.y, -forward.x, 0)
      .multiplyScalar(aside * far)
      .addScaledVector(forward, ahead * far);
    this.camera.position.add(step);
    target.add(step);
    this.controls.update();
    this.mark();
  }

  /** The place on the ground under a pixel; null if it is in the sky. */
  placeAt(sx: number, sy: number): { x: number; y: number } | null {
    this.camera.updateMatrixWorld();
    const { width, height } = this.size;
    const ray = new Vector3((2 * sx) / width - 1, 1 - (2 * sy) / height, 0.5)
      .unproject(this.camera)
      .sub(this.camera.position);
    const ground = this.mode === "above" ? this.controls.target.z : this.camera.position.z - 1.5;
    const along = (ground - this.camera.position.z) / ray.z;
    if (!(along > 0)) return null;
    return {
      x: this.camera.position.x + along * ray.x + this.origin[0],
      y: this.camera.position.y + along * ray.y + this.origin[1],
    };
  }

  /** What is seen now, in one canvas: the given one, or a new one. */
  picture(into = document.createElement("canvas")): HTMLCanvasElement {
    this.frame();
    if (into.width !== this.canvas.width) into.width = this.canvas.width;
    if (into.height !== this.canvas.height) into.height = this.canvas.height;
    into.getContext("2d")?.drawImage(this.canvas, 0, 0);
    return into;
  }

  destroy(): void {
    cancelAnimationFrame(this.pending);
    this.controls.dispose();
    this.scene.traverse((one) => {
      if (one instanceof Mesh) {
        (one.geometry as BufferGeometry).dispose();
        for (const material of [one.material].flat() as Material[]) material.dispose();
      }
    });
    this.renderer.dispose();
    this.canvas.remove();
  }

  private build(drawing: PackedDrawing): void {
    const { origin, heights } = this;
    const { flat } = heights;
    const add = (made: BufferGeometry, look: Material): void => {
      if (made.getAttribute("position").count > 0) this.scene.add(new Mesh(made, look));
    };
    const levels = new Set([...drawing.areas, ...drawing.marks].map(([level]) => level));
    const ground = Math.min(...levels);
    add(this.land(drawing.bounds), paint(LIGHT.land, 0));
    for (const [level, kind, rings] of drawing.areas) {
      const look = paint(LIGHT.areas[kind] ?? LIGHT.otherArea, 1);
      if (kind === "road") this.roads.push(look);
      add(surface(rings, origin, this.heightAt(level, 0), flat), look);
    }
    const flatOn = (lines: PackedLines, color: string, coats: number): void =>
      add(surface(lines, origin, this.heightAt(ground, coats * COAT), flat), paint(color, 1 + coats));
    flatOn(drawing.crosswalks, CROSSWALK, 1);
    flatOn(drawing.bars, LIGHT.bar, 2);
    add(
      ribbons(drawing.stop_lines, STOP_LINE, null, origin, this.heightAt(ground, 2 * COAT), flat),
      paint(LIGHT.stopLine, 3),
    );
    for (const [level, color, width, dash, lines] of drawing.marks) {
      const height = this.heightAt(level, 2 * COAT);
      add(ribbons(lines, width, dash, origin, height, flat), paint(LIGHT.marks[color] ?? color, 3));
    }
    const tall = (ring: number): number => STOREYS[ring % STOREYS.length] ?? 8;
    add(blocks(drawing.buildings, origin, this.heightAt(), tall), paint(LIGHT.building, 0));
    this.scene.add(signs(drawing.symbols, origin, this.heightAt()));
  }

  /** Land around and below the roads, which follows them where they are not flat. */
  private land([x0, y0, x1, y1]: Bounds): BufferGeometry {
    const beyond = 0.4 * Math.max(x1 - x0, y1 - y0) + 200;
    const [low, high] = [new Vector2(x0 - beyond, y0 - beyond), new Vector2(x1 + beyond, y1 + beyond)];
    const cells = this.heights.flat ? 1 : LAND_CELLS;
    const height = this.heightAt(0, this.heights.flat ? -0.03 : -0.35);
    const places: number[] = [];
    const corner = (i: number, j: number): number[] => {
      const x = low.x + ((high.x - low.x) * i) / cells - this.origin[0];
      const y = low.y + ((high.y - low.y) * j) / cells - this.origin[1];
      return [x, y, height(x, y)];
    };
    for (let i = 0; i < cells; i++)
      for (let j = 0; j < cells; j++) {
        const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        places.push(...a, ...b, ...c, ...a, ...c, ...d);
      }
    return withUpNormals(places);
  }

  private heightAt(level = 0, lift = 0): HeightAt {
    const [x0, y0] = this.origin;
    return (x, y) => this.heights.at(x + x0, y + y0, { level }) + lift;
  }

  private local(x: number, y: number): [number, number] {
    return [x - this.origin[0], y - this.origin[1]];
  }

  /** Places road users, and the camera that goes with one. */
  private showCrowd(): void {
    const { moving, mode } = this;
    if (moving) {
      const row = moving.followed >= 0 ? moving.followed : moving.ego;
      const carried = mode !== "above" && row >= 0;
      this.crowd.show(moving, carried && mode === "seat" ? row : -1);
      if (carried) {
        const { eye, target } = (mode === "seat" ? seat : behind)(this.crowd.carried(moving, row));
        this.camera.position.set(...eye);
        this.camera.lookAt(...target);
        // From here on the mouse turns about what is in sight, once one looks from above again.
        this.controls.target.set(...target);
      }
    } else this.crowd.show(EMPTY, -1);
    this.mark();
  }

  private mark(): void {
    this.pending ||= requestAnimationFrame(() => this.frame());
  }

  private frame(): void {
    cancelAnimationFrame(this.pending);
    this.pending = 0;
    const began = performance.now();
    if (this.rain.visible) {
      this.rain.position.copy(this.camera.position);
      this.rain.rotation.z = (began / 90) % (2 * Math.PI);
    }
    this.renderer.render(this.scene, this.camera);
    this.stats.frames += 1;
    this.stats.busy += performance.now() - began;
  }

  private resize(): void {
    const { width, height } = this.size;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.mark();
  }
}

const ROAD = new Color("#70777f");
const CROSSWALK = "#8e95a6";
const EMPTY: Moving = {
  count: 0,
  pose: new Float64Array(0),
  category: new Uint8Array(0),
  flags: new Uint8Array(0),
  ego: -1,
  followed: -1,
};

/** A matt surface; what has more coats lies above where both are at one height. */
function paint(color: string, coats: number): MeshLambertMaterial {
  return new MeshLambertMaterial({
    color,
    side: DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: -coats,
    polygonOffsetUnits: -4 * coats,
  });
}

/** Streaks of rain around the camera, the same each time. */
function drops(): LineSegments {
  const places: number[] = [];
  let seed = 1;
  const next = (): number => (seed = (seed * 16807) % 2147483647) / 2147483647;
  for (let k = 0; k < DROPS; k++) {
    const [x, y, z] = [(next() - 0.5) * 40, (next() - 0.5) * 40, (next() - 0.5) * 16];
    places.push(x, y, z, x + 0.03, y, z - 0.7);
  }
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  const look = new LineBasicMaterial({ color: 0xb9c7d4, transparent: true, opacity: 0.45 });
  const rain = new LineSegments(made, look);
  rain.frustumCulled = false;
  return rain;
}
