import type { Head } from "../signals/heads";
import { BaseLayer } from "./baseLayer";
import { DARK, LIGHT, type Palette } from "./colors";
import type { PackedDrawing } from "./drawing";
import type { Graph } from "./graph";
import { FIRST_LAYERS, type MapLayers } from "./mapLayers";
import type { MeasureMarks } from "./measureMarks";
import { MovingLayer } from "./movingLayer";
import type { Picker } from "./picking";
import { SceneLayer } from "./sceneLayer";
import { EMPTY_SCENE, type Mark, type Moving, type Scene } from "./scene";
import { writtenPath, writtenPicture } from "./svg";
import type { Underlay } from "./underlay";
import type { Size, View } from "./view";
import { drawLegend, type LegendRow } from "./writtenLegend";

/** What the page asks of a drawing of the map; another technique need only offer this. */
export interface MapRenderer {
  setTheme(dark: boolean): void;
  setSize(size: Size, pixelRatio: number): void;
  setView(view: View): void;
  setScene(scene: Scene): void;
  setLayers(layers: MapLayers): void;
  /** A picture under the map, and how much the roads hide of it, 0 to 1. */
  setUnderlay(underlay: Underlay | null, roads: number): void;
  setMoving(moving: Moving | null): void;
  setHeads(heads: readonly Head[]): void;
  setMarks(marks: readonly Mark[]): void;
  setMeasured(measured: MeasureMarks | null): void;
  /** What is seen now, in one canvas: the given one, or a new one. */
  picture(into?: HTMLCanvasElement): HTMLCanvasElement;
  /** The same as an SVG file, with a legend. */
  vector(legend: readonly LegendRow[]): string;
  /** Draws the whole map small, for the minimap. */
  drawOverview(canvas: HTMLCanvasElement, view: View, size: Size, pixelRatio: number, dark: boolean): void;
  destroy(): void;
}

/** Above this many milliseconds the base is moved as a picture while the view changes. */
const SLOW = 9;
/** The base is drawn this much larger than the canvas, so that a pan finds it drawn already. */
const MARGIN = 0.25;
const REST = 90;
const OVERVIEW = { signs: false, buildings: true };

/** Three canvases on top of each other; each is drawn only when its own content has changed. */
export class CanvasRenderer implements MapRenderer {
  private readonly base: BaseLayer;
  private readonly scene: SceneLayer;
  private readonly moving: MovingLayer;
  private readonly canvases: HTMLCanvasElement[];
  private readonly cache = document.createElement("canvas");
  private cacheView: View | null = null;
  private cost = 0;
  private size: Size = { width: 1, height: 1 };
  private ratio = 1;
  private view: View = { x: 0, y: 0, scale: 1 };
  private palette: Palette = LIGHT;
  private dirty = { base: true, scene: true, moving: true };
  private pending = 0;
  private rest = 0;
  private currentScene: Scene = EMPTY_SCENE;
  private currentMoving: Moving | null = null;
  private layers: MapLayers = FIRST_LAYERS;
  /** For the benchmark: how often something was drawn, and for how long. */
  readonly stats = { frames: 0, busy: 0 };

  constructor(
    host: HTMLElement,
    private readonly drawing: PackedDrawing,
    private readonly graph: Graph | null,
    private readonly picker: Picker | null,
  ) {
    this.base = new BaseLayer(drawing);
    this.scene = new SceneLayer(graph, picker);
    this.moving = new MovingLayer();
    this.canvases = ["base", "scene", "moving"].map((name) => {
      const canvas = document.createElement("canvas");
      canvas.dataset.layer = name;
      canvas.setAttribute("aria-hidden", "true");
      canvas.style.cssText = "position:absolute;inset:0;width:100%;height:100%;pointer-events:none";
      host.append(canvas);
      return canvas;
    });
  }

  setTheme(dark: boolean): void {
    this.palette = dark ? DARK : LIGHT;
    this.cacheView = null;
    this.mark("base", "scene", "moving");
  }

  setSize(size: Size, pixelRatio: number): void {
    this.size = size;
    this.ratio = pixelRatio;
    for (const canvas of this.canvases) {
      canvas.width = Math.max(1, Math.round(size.width * pixelRatio));
      canvas.height = Math.max(1, Math.round(size.height * pixelRatio));
    }
    this.cacheView = null;
    this.mark("base", "scene", "moving");
  }

  setView(view: View): void {
    this.view = view;
    this.mark("base", "scene", "moving");
  }

  setScene(scene: Scene): void {
    this.currentScene = scene;
    this.mark("scene");
  }

  setLayers(layers: MapLayers): void {
    const { signs, buildings } = this.layers;
    this.layers = layers;
    if (layers.signs !== signs || layers.buildings !== buildings) {
      this.cacheView = null;
      this.mark("base");
    }
    this.mark("scene");
  }

  setUnderlay(underlay: Underlay | null, roads: number): void {
    if (this.base.underlay === underlay && this.base.roads === roads) return;
    this.base.underlay = underlay;
    this.base.roads = roads;
    this.cacheView = null;
    this.mark("base");
  }

  setMoving(moving: Moving | null): void {
    this.currentMoving = moving;
    this.mark("moving");
  }

  setHeads(heads: readonly Head[]): void {
    this.moving.heads = heads;
    this.mark("moving");
  }

  setMarks(marks: readonly Mark[]): void {
    this.moving.marks = marks;
    this.mark("moving");
  }

  setMeasured(measured: MeasureMarks | null): void {
    this.moving.measured = measured;
    this.mark("moving");
  }

  drawOverview(canvas: HTMLCanvasElement, view: View, size: Size, pixelRatio: number, dark: boolean): void {
    canvas.width = Math.round(size.width * pixelRatio);
    canvas.height = Math.round(size.height * pixelRatio);
    const context = canvas.getContext("2d");
    if (context) this.base.draw(context, view, size, pixelRatio, dark ? DARK : LIGHT, OVERVIEW);
  }

  picture(into = document.createElement("canvas")): HTMLCanvasElement {
    const [first] = this.canvases;
    const [width, height] = [first?.width ?? 1, first?.height ?? 1];
    // To give a canvas a size empties it.
    if (into.width !== width) into.width = width;
    if (into.height !== height) into.height = height;
    const context = into.getContext("2d");
    if (this.pending) {
      cancelAnimationFrame(this.pending);
      this.frame();
    }
    for (const canvas of this.canvases) context?.drawImage(canvas, 0, 0);
    return into;
  }

  vector(legend: readonly LegendRow[]): string {
    const { view, size, palette } = this;
    // Paths for a screen cannot be read: they are made anew, as words.
    const base = new BaseLayer(this.drawing, writtenPath);
    base.underlay = this.base.underlay;
    base.roads = this.base.roads;
    const scene = new SceneLayer(this.graph, this.picker, writtenPath);
    return writtenPicture(size, (context) => {
      base.draw(context, view, size, 1, palette, this.layers);
      scene.draw(context, view, size, 1, palette, this.currentScene, this.layers);
      this.moving.draw(context, view, size, 1, palette, this.currentMoving);
      drawLegend(context, legend, palette, size.height);
    });
  }

  destroy(): void {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.rest);
    for (const canvas of this.canvases) canvas.remove();
  }

  private mark(...layers: ("base" | "scene" | "moving")[]): void {
    for (const layer of layers) this.dirty[layer] = true;
    if (!this.pending) this.pending = requestAnimationFrame(() => this.frame());
  }

  private frame(): void {
    this.pending = 0;
    const began = performance.now();
    const [base, scene, moving] = this.canvases.map((canvas) => canvas.getContext("2d"));
    if (!base || !scene || !moving) return;
    const { dirty, view, size, ratio, palette } = this;
    this.dirty = { base: false, scene: false, moving: false };
    if (dirty.base) this.drawBase(base);
    if (dirty.scene) this.scene.draw(scene, view, size, ratio, palette, this.currentScene, this.layers);
    if (dirty.moving) this.moving.draw(moving, view, size, ratio, palette, this.currentMoving);
    this.stats.frames += 1;
    this.stats.busy += performance.now() - began;
  }

  private drawBase(context: CanvasRenderingContext2D): void {
    clearTimeout(this.rest);
    const same = this.cacheView?.scale === this.view.scale;
    if (this.cacheView && (this.cost > SLOW || same) && this.covers(this.cacheView)) {
      this.blit(context, this.cacheView);
      if (!same) this.rest = window.setTimeout(() => this.crisp(), REST);
      return;
    }
    this.fillCache();
    if (this.cacheView) this.blit(context, this.cacheView);
  }

  /** Draws the base anew once the view rests after a zoom. */
  private crisp(): void {
    this.cacheView = null;
    this.mark("base");
  }

  private fillCache(): void {
    const { view, size, ratio, palette } = this;
    const big = { width: size.width * (1 + 2 * MARGIN), height: size.height * (1 + 2 * MARGIN) };
    const width = Math.round(big.width * ratio);
    const height = Math.round(big.height * ratio);
    if (this.cache.width !== width) this.cache.width = width;
    if (this.cache.height !== height) this.cache.height = height;
    const context = this.cache.getContext("2d");
    if (!context) return;
    const began = performance.now();
    this.base.draw(context, view, big, ratio, palette, this.layers);
    this.cost = performance.now() - began;
    this.cacheView = view;
  }

  /** Whether the picture reaches over the whole canvas, or nearly so while zooming out. */
  private covers(cached: View): boolean {
    const { view, size } = this;
    const zoom = view.scale / cached.scale;
    const reach = (length: number, off: number): boolean =>
      Math.abs(off) * view.scale + length / 2 <= (length / 2 + length * MARGIN) * zoom + 1;
    const inside = reach(size.width, view.x - cached.x) && reach(size.height, view.y - cached.y);
    return inside && zoom < 2.5;
  }

  private blit(context: CanvasRenderingContext2D, cached: View): void {
    const { view, size, ratio } = this;
    const zoom = view.scale / cached.scale;
    const width = size.width * (1 + 2 * MARGIN) * zoom;
    const height = size.height * (1 + 2 * MARGIN) * zoom;
    const left = size.width / 2 + (cached.x - view.x) * view.scale - width / 2;
    const top = size.height / 2 - (cached.y - view.y) * view.scale - height / 2;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.imageSmoothingEnabled = zoom !== 1;
    context.drawImage(
      this.cache,
      zoom === 1 ? Math.round(left * ratio) : left * ratio,
      zoom === 1 ? Math.round(top * ratio) : top * ratio,
      zoom === 1 ? this.cache.width : width * ratio,
      zoom === 1 ? this.cache.height : height * ratio,
    );
  }
}
