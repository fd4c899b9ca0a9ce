import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  FogExp2,
  Frustum,
  Group,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Scene,
  ShaderMaterial,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { MapControls } from "three/addons/controls/MapControls.js";

import type { Bounds } from "../api/types";
import { nth } from "../lists";
import { LIGHT } from "../map/colors";
import type { PackedDrawing, PackedLines } from "../map/drawing";
import type { Moving } from "../map/scene";
import type { Size, View } from "../map/view";
import type { Head } from "../signals/heads";
import { above, ANGLE, behind, type Camera, seat } from "./cameras";
import { CrowdOfBodies } from "./crowd";
import { blocks, type HeightAt, type Origin, ribbons, surface, tiles } from "./ground";
import type { Heights } from "./heights";
import { drawsInSoftware, Sharpness } from "./sharpness";
import { Lights, signs } from "./signs";
import { StillPicture } from "./still";
import { skyOf, type Sky } from "./weather";

/** Metres between paint and what it lies on, so that it is not lost in it from afar. */
const COAT = 0.015;
/** Width of a stop line, m. */
const STOP_LINE = 0.4;
/** Of a building whose height the map does not draw, m. */
const STOREYS = [6, 9, 12];
/** Of the light of a sky from above, what falls on the ground. */
const OPEN_SKY = 0.78;
/** Cells along the longer side of the land around roads. */
const LAND_CELLS = 64;
const DROPS = 900;
/** Of what lies on the ground the topmost, which is drawn first after bodies. */
const UPPERMOST = 10;
/** Pixels below which a mark is too thin to be seen. */
const HAIR = 0.12;
/** Milliseconds without a change after which a picture is drawn as sharp as can be. */
const STILL = 250;
const TILT = Math.PI / 2 - 0.05;
/** Metres from a camera at which anything is seen, and from above the share of how far away the ground is. */
const [NEAR, NEAR_SHARE] = [0.4, 0.04];

/** A map and its road users in three dimensions; drawn when something has changed. */
export class Scenery {
  readonly canvas: HTMLCanvasElement;
  /** How often something was drawn, and for how many milliseconds the page was busy with it. */
  readonly stats = { frames: 0, busy: 0 };
  private readonly sharpness: Sharpness;
  /** Pixels per CSS pixel of the picture that is seen. */
  private shown: number;
  private settling = 0;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  /** What stays as it is. */
  private readonly town = new Group();
  /** What moves, or changes by itself. */
  private readonly life = new Group();
  private readonly still: StillPicture;
  /** From where the town was seen last, and whether there is a picture of it from there. */
  private seenFrom: number[] = [];
  private kept = false;
  private readonly camera = new PerspectiveCamera(ANGLE.above, 1, NEAR, 6000);
  private readonly controls: MapControls;
  private readonly origin: Origin;
  private readonly crowd: CrowdOfBodies;
  private readonly lights = new Lights();
  private readonly around = new HemisphereLight(0xffffff, 0x8a8f80, 1.6);
  private readonly glow = new AmbientLight(0xffffff, 0.2);
  private readonly sun = new DirectionalLight(0xffffff, 2);
  private readonly rain = drops();
  /** What lies on the ground and has no shades, with its colour in full light. */
  private readonly lying: { look: ShaderMaterial; color: Color; road: boolean }[] = [];
  /** Colour of the fog as it is shown, and its density, for what lies on the ground. */
  private readonly haze = { fog: { value: new Color() }, density: { value: 0 } };
  /** Marks with their widths in metres, not drawn where they are finer than a pixel. */
  private readonly thin: { mesh: Mesh; width: number }[] = [];
  private moving: Moving | null = null;
  private mode: Camera = "above";
  private size: Size = { width: 1, height: 1 };
  private pending = 0;

  constructor(
    host: HTMLElement,
    drawing: PackedDrawing,
    private readonly heights: Heights,
    pixelRatio: number,
  ) {
    const probe = document.createElement("canvas").getContext("webgl2");
    this.renderer = new WebGLRenderer({ antialias: !drawsInSoftware(probe) });
    probe?.getExtension("WEBGL_lose_context")?.loseContext();
    this.still = new StillPicture(this.renderer.getContext());
    this.sharpness = new Sharpness(pixelRatio);
    this.shown = pixelRatio;
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
    this.around.position.set(0, 0, 1);
    this.scene.add(this.around, this.glow, this.sun, this.sun.target);
    this.build(drawing);
    this.life.add(this.crowd.group, this.lights.group, this.rain);
    this.scene.add(this.town, this.life);
    this.setWeather({});
  }

  setSize(size: Size): void {
    this.size = size;
    this.resize(this.sharpness.ratio);
    this.mark();
  }

  setWeather(values: Readonly<Record<string, number>>): void {
    const sky: Sky = skyOf(values);
    // Not the background of the scene: that is drawn over a picture that is kept.
    this.renderer.setClearColor(sky.color);
    this.scene.fog = new FogExp2(sky.color, sky.fog);
    this.around.color = sky.color.clone().lerp(new Color(0xffffff), 0.6);
    this.around.intensity = OPEN_SKY * sky.ambient;
    this.glow.intensity = sky.dark ? 0.55 : 0.15;
    this.sun.color = sky.sunColor;
    this.sun.intensity = sky.sun;
    this.sun.position.set(...sky.towards).multiplyScalar(100);
    this.crowd.dark = sky.dark;
    this.rain.visible = sky.rain > 0.05;
    this.rain.geometry.setDrawRange(0, 2 * Math.round(DROPS * sky.rain));
    this.haze.fog.value.copy(sky.color).convertLinearToSRGB();
    this.haze.density.value = sky.fog;
    const light = this.lightFromAbove();
    for (const { look, color, road } of this.lying)
      // Water makes a road darker.
      colorOf(look)
        .copy(color)
        .multiply(light)
        .multiplyScalar(road ? 1 - 0.4 * sky.wet : 1)
        .convertLinearToSRGB();
    this.seenFrom = [];
    this.mark();
  }

  setMoving(moving: Moving | null): void {
    this.moving = moving;
    this.carryCamera();
    this.mark();
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
    this.carryCamera();
    this.mark();
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
    this.drawSharp();
    if (into.width !== this.canvas.width) into.width = this.canvas.width;
    if (into.height !== this.canvas.height) into.height = this.canvas.height;
    into.getContext("2d")?.drawImage(this.canvas, 0, 0);
    return into;
  }

  destroy(): void {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.settling);
    this.controls.dispose();
    this.scene.traverse((one) => {
      if (one instanceof Mesh) {
        (one.geometry as BufferGeometry).dispose();
        for (const material of [one.material].flat() as Material[]) material.dispose();
      }
    });
    this.still.drop();
    this.renderer.dispose();
    this.canvas.remove();
  }

  private build(drawing: PackedDrawing): void {
    const { origin, heights } = this;
    const { flat } = heights;
    const lay = (
      triangles: readonly number[],
      color: string,
      coats: number,
      { road = false, width = Infinity } = {},
    ): void => {
      const look = lyingAs(coats, this.haze);
      this.lying.push({ look, color: new Color(color), road });
      for (const made of tiles(triangles)) {
        const mesh = new Mesh(made, look);
        // What lies on top first: what it hides is then not painted.
        mesh.renderOrder = UPPERMOST - coats;
        if (Number.isFinite(width)) this.thin.push({ mesh, width });
        this.town.add(mesh);
      }
    };
    const levels = new Set([...drawing.areas, ...drawing.marks].map(([level]) => level));
    const ground = Math.min(...levels);
    lay(this.land(drawing.bounds), LIGHT.land, 0);
    for (const [level, kind, rings] of drawing.areas) {
      const road = kind === "road";
      const color = road ? ROAD : (LIGHT.areas[kind] ?? LIGHT.otherArea);
      lay(surface(rings, origin, this.heightAt(level, 0), flat), color, 1, { road });
    }
    const flatOn = (lines: PackedLines, color: string, coats: number): void =>
      lay(surface(lines, origin, this.heightAt(ground, coats * COAT), flat), color, 1 + coats);
    flatOn(drawing.crosswalks, CROSSWALK, 1);
    flatOn(drawing.bars, LIGHT.bar, 2);
    lay(
      ribbons(drawing.stop_lines, STOP_LINE, null, origin, this.heightAt(ground, 2 * COAT), flat),
      LIGHT.stopLine,
      3,
      { width: STOP_LINE },
    );
    for (const [level, color, width, dash, lines] of drawing.marks) {
      const height = this.heightAt(level, 2 * COAT);
      lay(ribbons(lines, width, dash, origin, height, flat), LIGHT.marks[color] ?? color, 3, { width });
    }
    const tall = (ring: number): number => STOREYS[ring % STOREYS.length] ?? 8;
    const walls = blocks(drawing.buildings, origin, this.heightAt(), tall);
    if (walls.getAttribute("position").count > 0)
      this.town.add(new Mesh(walls, new MeshLambertMaterial({ color: LIGHT.building, side: DoubleSide })));
    this.town.add(signs(drawing.symbols, origin, this.heightAt()));
  }

  /** Light on what is level, as the matt materials of three.js have it. */
  private lightFromAbove(): Color {
    const light = new Color(0);
    for (const { color, intensity } of [this.around, this.glow])
      light.add(color.clone().multiplyScalar(intensity));
    const steep = this.sun.position.z / this.sun.position.length();
    light.add(this.sun.color.clone().multiplyScalar(this.sun.intensity * steep));
    return light.multiplyScalar(1 / Math.PI);
  }

  /** Land around and below the roads, which follows them where they are not flat. */
  private land([x0, y0, x1, y1]: Bounds): number[] {
    const beyond = 0.4 * Math.max(x1 - x0, y1 - y0) + 200;
    const [low, high] = [new Vector2(x0 - beyond, y0 - beyond), new Vector2(x1 + beyond, y1 + beyond)];
    const cells = this.heights.flat ? 1 : LAND_CELLS;
    const height = this.heightAt(0, this.heights.flat ? -0.03 : -0.35);
    const corners: [number, number, number][] = [];
    for (let k = 0; k < (cells + 1) ** 2; k++) {
      const [i, j] = [Math.floor(k / (cells + 1)), k % (cells + 1)];
      const x = low.x + ((high.x - low.x) * i) / cells - this.origin[0];
      const y = low.y + ((high.y - low.y) * j) / cells - this.origin[1];
      corners.push([x, y, height(x, y)]);
    }
    const places: number[] = [];
    const corner = (i: number, j: number): [number, number, number] => nth(corners, i * (cells + 1) + j);
    for (let i = 0; i < cells; i++)
      for (let j = 0; j < cells; j++) {
        const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        places.push(...a, ...b, ...c, ...a, ...c, ...d);
      }
    return places;
  }

  private heightAt(level = 0, lift = 0): HeightAt {
    const [x0, y0] = this.origin;
    return (x, y) => this.heights.at(x + x0, y + y0, { level }) + lift;
  }

  private local(x: number, y: number): [number, number] {
    return [x - this.origin[0], y - this.origin[1]];
  }

  /** Who the camera goes with: the row of who is followed, else of the ego; -1 if it stays. */
  private carrier(): number {
    if (this.mode === "above" || !this.moving) return -1;
    return this.moving.followed >= 0 ? this.moving.followed : this.moving.ego;
  }

  /** Moves the camera with whom it goes with. */
  private carryCamera(): void {
    const row = this.carrier();
    if (!this.moving || row < 0) return;
    const { eye, target } = (this.mode === "seat" ? seat : behind)(this.crowd.carried(this.moving, row));
    this.camera.position.set(...eye);
    this.camera.lookAt(...target);
    // From here on the mouse turns about what is in sight, once one looks from above again.
    this.controls.target.set(...target);
  }

  /** Places the road users, and shows the marks, that the camera sees. */
  private showSeen(): void {
    const { camera } = this;
    // The depths of a picture are finest near by: from high above roofs would be lost in the road.
    const away = this.mode === "above" ? camera.position.distanceTo(this.controls.target) : 0;
    camera.near = Math.max(NEAR, NEAR_SHARE * away);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    const seen = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const span = this.size.height / (2 * Math.tan((camera.fov * Math.PI) / 360));
    this.crowd.show(this.moving ?? EMPTY, this.mode === "seat" ? this.carrier() : -1, {
      frustum: new Frustum().setFromProjectionMatrix(seen),
      eye: camera.position,
      span,
    });
    for (const { mesh, width } of this.thin) {
      const ball = mesh.geometry.boundingSphere;
      const apart = ball ? camera.position.distanceTo(ball.center) - ball.radius : 0;
      mesh.visible = width * span > HAIR * apart;
    }
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
    if (this.shown !== this.sharpness.ratio) this.resize(this.sharpness.ratio);
    this.draw(began);
    if (this.sharpness.isDue()) {
      this.waitUntilDrawn();
      this.sharpness.adapt(performance.now() - began);
    }
    // When nothing has moved for a while it is drawn once more, as sharp as the screen is.
    clearTimeout(this.settling);
    if (this.shown !== this.sharpness.full) this.settling = window.setTimeout(() => this.drawSharp(), STILL);
  }

  private drawSharp(): void {
    if (this.shown !== this.sharpness.full) this.resize(this.sharpness.full);
    this.draw(performance.now());
  }

  private draw(began: number): void {
    this.showSeen();
    this.render();
    this.stats.frames += 1;
    this.stats.busy += performance.now() - began;
  }

  /** Draws all, or adds what moves to a picture of the town while the camera stays. */
  private render(): void {
    const { width, height } = this.canvas;
    const from = [
      ...this.camera.matrixWorld.elements,
      ...this.camera.projectionMatrix.elements,
      width,
      height,
    ];
    if (from.some((number, k) => number !== this.seenFrom[k])) {
      this.kept = false;
      this.seenFrom = from;
      this.renderer.render(this.scene, this.camera);
      return;
    }
    if (this.kept) this.still.show(width, height);
    else {
      this.life.visible = false;
      this.renderer.render(this.scene, this.camera);
      this.life.visible = true;
      this.kept = this.still.keep(width, height);
    }
    this.renderer.autoClear = false;
    this.town.visible = false;
    this.renderer.render(this.scene, this.camera);
    this.town.visible = true;
    this.renderer.autoClear = true;
  }

  /** Reads a pixel back: the only sign that a picture is finished, not only ordered. */
  private waitUntilDrawn(): void {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  private resize(ratio: number): void {
    const { width, height } = this.size;
    this.shown = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
  }
}

const ROAD = "#70777f";
const CROSSWALK = "#8e95a6";
const EMPTY: Moving = {
  count: 0,
  pose: new Float64Array(0),
  category: new Uint8Array(0),
  flags: new Uint8Array(0),
  ego: -1,
  followed: -1,
};

/**
 * A level surface; what has more coats lies above where both are at one height.
 *
 * Light falls on all of it alike and fog is found at its corners, so that a pixel costs next to
 * nothing: without a graphics card the ground is most of what is paid for.
 */
function lyingAs(coats: number, haze: Record<string, { value: unknown }>): ShaderMaterial {
  return new ShaderMaterial({
    uniforms: { color: { value: new Color() }, ...haze },
    vertexShader: `
      uniform float density;
      varying float share;
      void main() {
        vec4 seen = modelViewMatrix * vec4(position, 1.0);
        share = 1.0 - exp(-density * density * seen.z * seen.z);
        gl_Position = projectionMatrix * seen;
      }`,
    fragmentShader: `
      uniform vec3 color;
      uniform vec3 fog;
      varying float share;
      void main() {
        gl_FragColor = vec4(mix(color, fog, share), 1.0);
      }`,
    side: DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: -coats,
    polygonOffsetUnits: -4 * coats,
  });
}

const colorOf = (look: ShaderMaterial): Color => look.uniforms.color?.value as Color;

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
