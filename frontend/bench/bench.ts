import type { GraphColumns } from "../src/api/types";
import { nth } from "../src/lists";
import type { PackedDrawing } from "../src/map/drawing";
import { Graph } from "../src/map/graph";
import { Picker } from "../src/map/picking";
import { CanvasRenderer } from "../src/map/renderer";
import { EMPTY_SCENE } from "../src/map/scene";
import { fit, panBy, type Size, type View, zoomAt } from "../src/map/view";
import { crowd, load, map, options } from "./common";

/** Draws the map that the address names, with vehicles that move 20 times a second; see bench.py. */
const vehicles = Number(options.get("vehicles") ?? 2000);
const seconds = Number(options.get("seconds") ?? 4);

interface Figures {
  fps: number;
  busy: number;
  worst: number;
}

async function during(
  renderer: CanvasRenderer,
  columns: GraphColumns,
  move: (k: number) => void,
): Promise<Figures> {
  const began = performance.now();
  const start = { ...renderer.stats };
  let last = began;
  let worst = 0;
  let frames = 0;
  let sent = 0;
  return new Promise((done) => {
    const tick = (now: number): void => {
      if (frames > 0) worst = Math.max(worst, now - last);
      last = now;
      frames += 1;
      if (now - sent >= 50) {
        sent = now;
        renderer.setMoving(crowd(columns, vehicles, (now - began) / 1000));
      }
      move(frames);
      if (now - began < 1000 * seconds) requestAnimationFrame(tick);
      else {
        const drawn = renderer.stats.frames - start.frames;
        done({
          fps: (1000 * frames) / (now - began),
          busy: (renderer.stats.busy - start.busy) / drawn,
          worst,
        });
      }
    };
    requestAnimationFrame(tick);
  });
}

async function main(): Promise<void> {
  const began = performance.now();
  const [drawing, columns] = await Promise.all([load<PackedDrawing>("drawing"), load<GraphColumns>("graph")]);
  const fetched = performance.now();
  const graph = new Graph(columns);
  const picker = new Picker(graph);
  const host = document.getElementById("host");
  if (!host) return;
  const size: Size = { width: host.clientWidth, height: host.clientHeight };
  const renderer = new CanvasRenderer(host, drawing, graph, picker);
  renderer.setTheme(false);
  renderer.setSize(size, 1);
  renderer.setScene({ ...EMPTY_SCENE });
  const whole = fit(drawing.bounds, size);
  renderer.setView(whole);
  const ready = performance.now();

  const at = (scale: number): View => ({ x: nth(columns.x, 4000), y: nth(columns.y, 4000), scale });
  const results: Record<string, Figures> = {};
  const sway =
    (view: View) =>
    (k: number): void =>
      renderer.setView(panBy(view, 160 * Math.sin(k / 25), 110 * Math.sin(k / 40)));
  results["still, whole map"] = await during(renderer, columns, () => undefined);
  results["panning, whole map"] = await during(renderer, columns, sway(whole));
  results["panning, 3 px/m"] = await during(renderer, columns, sway(at(3)));
  results["panning, 12 px/m"] = await during(renderer, columns, sway(at(12)));
  results["zooming"] = await during(renderer, columns, (k) =>
    renderer.setView(zoomAt(at(3), size, Math.exp(1.8 * Math.sin(k / 30)), 300, 300, whole.scale)),
  );

  const picks: number[] = [];
  for (let i = 0; i < 500; i++) {
    const node = (i * 37) % columns.x.length;
    const from = performance.now();
    picker.place(nth(columns.x, node) + 1, nth(columns.y, node) - 1, 20, { vehicles: true, walks: true });
    picker.segment(nth(columns.x, node) + 3, nth(columns.y, node) - 3, 20);
    picks.push(performance.now() - from);
  }
  picks.sort((a, b) => a - b);
  Object.assign(window, {
    odscenBench: {
      map,
      vehicles,
      nodes: columns.x.length,
      fetched: fetched - began,
      ready: ready - fetched,
      results,
      pick: { median: nth(picks, 250), worst: nth(picks, 499) },
    },
  });
}

void main();
