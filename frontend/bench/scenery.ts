import type { GraphColumns, HeightColumns } from "../src/api/types";
import { nth } from "../src/lists";
import type { PackedDrawing } from "../src/map/drawing";
import { Graph } from "../src/map/graph";
import { fit } from "../src/map/view";
import type { Camera } from "../src/scenery/cameras";
import { Heights } from "../src/scenery/heights";
import { Scenery } from "../src/scenery/scenery";
import { crowd, load, map, options } from "./common";

/** Shows the map that the address names in three dimensions, with a crowd that moves in each frame. */
const seconds = Number(options.get("seconds") ?? 4);

interface Figures {
  fps: number;
  busy: number;
  worst: number;
}

async function during(scenery: Scenery, columns: GraphColumns, vehicles: number): Promise<Figures> {
  const began = performance.now();
  let { frames, busy } = scenery.stats;
  let last = began;
  let worst = 0;
  return new Promise((done) => {
    const tick = (now: number): void => {
      worst = Math.max(worst, now - last);
      last = now;
      scenery.setMoving({ ...crowd(columns, vehicles, (now - began) / 1000), followed: 0 });
      if (now - began < 1000 * seconds) requestAnimationFrame(tick);
      else {
        frames = scenery.stats.frames - frames;
        busy = scenery.stats.busy - busy;
        done({ fps: (1000 * frames) / (now - began), busy: busy / frames, worst });
      }
    };
    requestAnimationFrame(tick);
  });
}

async function main(): Promise<void> {
  const began = performance.now();
  const [drawing, columns, heights] = await Promise.all([
    load<PackedDrawing>("drawing"),
    load<GraphColumns>("graph"),
    load<HeightColumns>("heights"),
  ]);
  const fetched = performance.now();
  const host = document.getElementById("host");
  if (!host) return;
  const size = { width: host.clientWidth, height: host.clientHeight };
  const { columns: rows } = new Graph(columns);
  const scenery = new Scenery(host, drawing, new Heights(rows, heights), 1);
  scenery.setSize(size);
  const ready = performance.now();
  const near = { x: nth(columns.x, 4000), y: nth(columns.y, 4000), scale: 3 };
  Object.assign(window, {
    odscenBench: { map, fetched: fetched - began, ready: ready - fetched },
    odscenSee: async (camera: Camera, whole: boolean, vehicles: number): Promise<Figures> => {
      scenery.setCamera("above");
      scenery.lookAt(whole ? fit(drawing.bounds, size) : near, 0.85);
      scenery.setCamera(camera);
      return during(scenery, columns, vehicles);
    },
  });
}

void main();
