import {
  CATEGORY_COLOR,
  EGO,
  ELIGIBLE,
  MEASURE,
  type Palette,
  PEDESTRIAN_NODE,
  PROBLEM,
  RELATION,
  ROI_BASE,
  ROI_MEMBER,
  UNUSABLE,
  VEHICLE_NODE,
} from "./colors";
import { clustered } from "./clusters";
import { detectorNames, drawDetectors } from "./detectorMarks";
import { nth } from "../lists";
import { GLYPHS } from "./glyphs";
import { type Graph, type Place, segmentBounds, strips } from "./graph";
import { drawGrid } from "./gridLayer";
import { addRing, ColoredLanes } from "./laneShapes";
import type { MapLayers } from "./mapLayers";
import { drawNames, type SegmentName, segmentNames } from "./namesLayer";
import { badgeRadius, type Marker, markers } from "./markers";
import {
  badge,
  body,
  brackets,
  dots,
  drawCluster,
  drawFlow,
  drawGoal,
  drawLane,
  drawGhosts,
  drawLines,
  drawOffset,
  drawPin,
  drawRoute,
  drawWalkEdges,
  drawWaypoint,
  inBody,
  spot,
  tag,
} from "./marks";
import type { Picker } from "./picking";
import type { Scene, SegmentStyle } from "./scene";
import { type PathMaker, screenPath } from "./svg";
import { overlaps, type Size, type View, visible, worldTransform } from "./view";
import type { Bounds, Category } from "../api/types";

const NODES_FROM = 2.6;
const EDGES_FROM = 7;
/** More names than these would lie on top of each other. */
const FEW = 3;
/** Signs are named from so many pixels a metre on, or where they are few. */
const NAMED_FROM = 1;
const FEW_PINS = 12;
/** Least length of the arrow at the pointer, pixels. */
const ARROW = 26;
/** No body reaches further from its middle, metres. */
const ROOM = 12;
/** Pixels from a detector down to its name. */
const DETECTOR_NAME = 18;

const SEGMENT: Record<SegmentStyle, { fill: string; alpha: number }> = {
  base: { fill: ROI_BASE, alpha: 0.72 },
  member: { fill: ROI_MEMBER, alpha: 0.55 },
  eligible: { fill: ELIGIBLE, alpha: 0.55 },
  problem: { fill: PROBLEM, alpha: 0.6 },
  measure: { fill: MEASURE, alpha: 0.6 },
};

/** What the user has made of the map: region, places, actors, goals and route. */
export class SceneLayer {
  private readonly segments: Path2D[] = [];
  private readonly bounds: Bounds[] = [];
  private readonly glyphs: Record<Category, Path2D>;
  private readonly colored: ColoredLanes;
  private names: SegmentName[] | null = null;

  constructor(
    private readonly graph: Graph | null,
    private readonly picker: Picker | null,
    private readonly newPath: PathMaker = screenPath,
  ) {
    this.glyphs = Object.fromEntries(
      Object.entries(GLYPHS).map(([name, path]) => [name, newPath(path)]),
    ) as Record<Category, Path2D>;
    this.colored = new ColoredLanes(newPath);
    if (!graph) return;
    this.bounds = segmentBounds(graph.columns);
    this.segments = graph.columns.segments.map(() => newPath());
    for (const { segment, ring } of strips(graph.columns)) addRing(nth(this.segments, segment), ring);
  }

  draw(
    context: CanvasRenderingContext2D,
    view: View,
    size: Size,
    ratio: number,
    palette: Palette,
    scene: Scene,
    layers: MapLayers,
  ): void {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    worldTransform(context, view, size, ratio);
    this.colored.draw(context, view, scene.laneColors ?? null);
    this.drawSegments(context, view, size, scene);
    if (layers.nodes && this.graph && this.picker && view.scale >= NODES_FROM) {
      this.drawGraph(context, view, size, scene, palette, layers.changes);
    }
    drawRoute(context, view, scene);
    if (scene.ghosts) drawGhosts(context, view, scene.ghosts, palette);
    drawLines(context, view, scene);
    drawDetectors(context, view, scene.detectors);
    if (scene.hover && this.graph) drawLane(context, this.graph, scene.hover);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (layers.grid) drawGrid(context, view, size, palette, this.newPath());
    if (layers.names && this.graph) {
      this.names ??= segmentNames(this.graph);
      drawNames(context, view, size, palette, this.names);
    }
    const at = (x: number, y: number): [number, number] => [
      (x - view.x) * view.scale + size.width / 2,
      (view.y - y) * view.scale + size.height / 2,
    ];
    for (const goal of scene.goals) drawGoal(context, at(goal.x, goal.y), false);
    if (scene.chosenGoal) drawGoal(context, at(scene.chosenGoal.x, scene.chosenGoal.y), true);
    scene.waypoints.forEach((place, n) => drawWaypoint(context, at(place.x, place.y), n + 1));
    if (scene.hover) this.drawHover(context, at, view, scene.hover, scene.hoverCategory);
    const named = scene.actors.reduce((n, actor) => n + Number(actor.selected), 0) <= FEW;
    const seen = visible(view, size);
    for (const marker of markers(scene.actors, at, view.scale)) {
      const { actor, x, y, look } = marker;
      const box: Bounds = [actor.x - ROOM, actor.y - ROOM, actor.x + ROOM, actor.y + ROOM];
      if (!overlaps(box, seen)) continue;
      if (look === "dot") spot(context, [x, y], CATEGORY_COLOR[actor.category]);
      else this.drawActor(context, marker, view, palette, named);
    }
    const namedPins = view.scale >= NAMED_FROM || scene.pins.length <= FEW_PINS;
    for (const { x, y, pins } of clustered(scene.pins, namedPins ? Infinity : view.scale)) {
      const [pin] = pins;
      if (pin && pins.length === 1) drawPin(context, at(pin.x, pin.y), pin, namedPins);
      else drawCluster(context, at(x, y), pins.length, palette);
    }
    if (view.scale >= NODES_FROM)
      for (const { x, y, label } of detectorNames(scene.detectors)) {
        const [px, py] = at(x, y);
        tag(context, label, px, py + DETECTOR_NAME);
      }
    for (const flow of scene.flows) drawFlow(context, at(flow.x, flow.y), flow, palette);
    if (scene.hover && scene.hoverText) {
      const [x, y] = at(scene.hover.x, scene.hover.y);
      // Below the arrow where it points down.
      const down = Math.max(0, -Math.sin(scene.hover.hdg)) * Math.max(ARROW, 4 * view.scale);
      tag(context, scene.hoverText, x, y + 24 + down);
    }
  }

  private drawSegments(context: CanvasRenderingContext2D, view: View, size: Size, scene: Scene): void {
    const seen = visible(view, size);
    for (const [row, style] of scene.segments) {
      const [path, bounds] = [this.segments[row], this.bounds[row]];
      if (!path || !bounds || !overlaps(bounds, seen)) continue;
      context.globalAlpha = SEGMENT[style].alpha;
      context.fillStyle = SEGMENT[style].fill;
      context.fill(path);
    }
    context.globalAlpha = SEGMENT.measure.alpha;
    context.fillStyle = SEGMENT.measure.fill;
    for (const ring of scene.lanes) {
      const path = this.newPath();
      addRing(path, ring);
      context.fill(path);
    }
    context.globalAlpha = 1;
    const hovered = scene.hoverSegment === null ? undefined : this.segments[scene.hoverSegment];
    if (hovered) {
      context.fillStyle = "#ffffff55";
      context.strokeStyle = ROI_BASE;
      context.lineWidth = 1.5 / view.scale;
      context.fill(hovered);
      context.stroke(hovered);
    }
  }

  private drawGraph(
    context: CanvasRenderingContext2D,
    view: View,
    size: Size,
    scene: Scene,
    palette: Palette,
    changes: boolean,
  ): void {
    if (!this.graph || !this.picker) return;
    const { columns } = this.graph;
    const { inside } = scene.nodes;
    const seen = visible(view, size);
    if (scene.nodes.vehicles) {
      const rows = this.picker
        .within(...seen, false)
        .filter((i) => !inside || inside.has(nth(columns.segment, i)));
      if (view.scale >= EDGES_FROM) this.drawEdges(context, view, new Set(rows), palette, changes);
      this.drawPlaces(context, view, rows, false);
    }
    if (scene.nodes.walks) {
      const { walks } = columns;
      const rows = this.picker
        .within(...seen, true)
        .filter((i) => !inside || inside.has(nth(walks.segment, i)));
      if (view.scale >= EDGES_FROM) drawWalkEdges(context, view, this.graph, new Set(rows));
      this.drawPlaces(context, view, rows, true);
    }
  }

  /** Places in their colour; grey where no start is possible. */
  private drawPlaces(context: CanvasRenderingContext2D, view: View, rows: number[], walk: boolean): void {
    if (!this.graph) return;
    const graph = this.graph;
    const at = walk ? graph.columns.walks : graph.columns;
    dots(
      context,
      view,
      at,
      rows.filter((i) => !graph.usable(i, walk)),
      UNUSABLE,
    );
    dots(
      context,
      view,
      at,
      rows.filter((i) => graph.usable(i, walk)),
      walk ? PEDESTRIAN_NODE : VEHICLE_NODE,
    );
  }

  /** Edges to the nodes ahead; with `changes` those to the lanes beside, too, which cross between each pair. */
  private drawEdges(
    context: CanvasRenderingContext2D,
    view: View,
    rows: Set<number>,
    palette: Palette,
    changes: boolean,
  ): void {
    if (!this.graph) return;
    const { columns } = this.graph;
    const { source, target, relation } = columns.edges;
    const paths = RELATION.map((color, n) => ({
      path: this.newPath(),
      color: n === 0 ? palette.successor : color,
    }));
    for (let e = 0; e < source.length; e++) {
      if (!rows.has(nth(source, e)) || (!changes && nth(relation, e) !== 0)) continue;
      const { path } = nth(paths, nth(relation, e));
      const [from, to] = [nth(source, e), nth(target, e)];
      path.moveTo(nth(columns.x, from), nth(columns.y, from));
      path.lineTo(nth(columns.x, to), nth(columns.y, to));
    }
    context.lineWidth = 1.1 / view.scale;
    for (const { path, color } of paths) {
      context.strokeStyle = color;
      context.globalAlpha = 0.75;
      context.stroke(path);
    }
    context.globalAlpha = 1;
  }

  private drawHover(
    context: CanvasRenderingContext2D,
    at: (x: number, y: number) => [number, number],
    view: View,
    place: Place,
    category: Category | null,
  ): void {
    const [x, y] = at(place.x, place.y);
    const color = place.walk ? PEDESTRIAN_NODE : VEHICLE_NODE;
    context.save();
    context.translate(x, y);
    context.rotate(-place.hdg);
    context.strokeStyle = color;
    context.fillStyle = `${color}66`;
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(0, 0, 9, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
    if (!place.walk) {
      const tip = Math.max(ARROW, 4 * view.scale);
      context.beginPath();
      context.moveTo(9, 0);
      context.lineTo(tip, 0);
      context.moveTo(tip - 7, -5);
      context.lineTo(tip, 0);
      context.lineTo(tip - 7, 5);
      context.stroke();
    }
    context.restore();
    if (category) {
      context.globalAlpha = 0.85;
      badge(context, this.glyphs[category], x, y - 26, 13, CATEGORY_COLOR[category], category);
      context.globalAlpha = 1;
    }
  }

  /** A body with its kind in it, or a badge in its place; a ring and corners around those one looks at. */
  private drawActor(
    context: CanvasRenderingContext2D,
    { actor, x, y, look }: Marker,
    view: View,
    palette: Palette,
    named: boolean,
  ): void {
    const color = CATEGORY_COLOR[actor.category];
    const ring = actor.problem ? PROBLEM : actor.ego ? EGO : actor.selected ? palette.ink : null;
    const radius = badgeRadius(view.scale) + (actor.selected ? 2 : 0);
    let half = radius;
    if (look === "body") {
      if (actor.offset) drawOffset(context, x, y, view, actor, palette);
      body(context, x, y, view, actor, color, ring);
      inBody(context, this.glyphs[actor.category], x, y, actor.width * view.scale, actor.category);
      const [c, s] = [Math.abs(Math.cos(actor.hdg)), Math.abs(Math.sin(actor.hdg))];
      half = Math.max(8, ((actor.length * s + actor.width * c) * view.scale) / 2);
      if (actor.selected) {
        const wide = ((actor.length * c + actor.width * s) * view.scale) / 2;
        brackets(context, [x, y], Math.max(half, wide) + 5, palette.ink);
        half = Math.max(half, wide) + 5;
      }
    } else {
      if (ring) {
        context.beginPath();
        context.arc(x, y, radius + 3, 0, 2 * Math.PI);
        context.fillStyle = ring;
        context.fill();
      }
      if (actor.selected) brackets(context, [x, y], radius + 7, palette.ink);
      badge(context, this.glyphs[actor.category], x, y, radius, color, actor.category);
    }
    const top = y - half - (actor.selected ? 18 : 11);
    if (actor.ego) tag(context, "EGO", x, top);
    else if (actor.selected && named) tag(context, actor.id, x, top);
  }
}
