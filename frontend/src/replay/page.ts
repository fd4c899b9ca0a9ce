/** The replay of a report in three dimensions: one script beside that of the plan, without the page. */
import {
  type Category,
  type GraphColumns,
  type HeightColumns,
  type PackedDrawing,
  CATEGORIES,
} from "../api/types";
import type { Moving } from "../map/scene";
import { isCamera } from "../scenery/cameras";
import { Heights } from "../scenery/heights";
import { steer } from "../scenery/keys";
import { Scenery } from "../scenery/scenery";
import type { Head } from "../signals/heads";

/** A road user at the moment that is shown, metres and radians. */
interface Body {
  category: Category;
  ego: boolean;
  x: number;
  y: number;
  hdg: number;
  length: number;
  width: number;
}

/** What the plan of the replay offers. */
interface Replay {
  stage: HTMLElement;
  /** Draws the moment anew. */
  draw: () => void;
  /** What part of the map the plan shows: its middle, and pixels of a metre. */
  view: () => { x: number; y: number; scale: number };
  /** Gets each moment that is drawn. */
  seen?: (bodies: readonly Body[], heads: readonly Head[]) => void;
}

interface Ground {
  drawing: PackedDrawing;
  nodes: Pick<GraphColumns, "x" | "y" | "hdg" | "walks">;
  heights: HeightColumns;
  weather: Record<string, number>;
}

declare global {
  interface Window {
    odscenReplay?: Replay;
  }
}

const TILT = 0.85;

function begin(replay: Replay, choice: HTMLSelectElement, ground: Ground): void {
  const { stage } = replay;
  let host: HTMLElement | null = null;
  let scenery: Scenery | null = null;
  const make = (): Scenery => {
    host = document.createElement("div");
    host.id = "replay-scenery";
    host.tabIndex = 0;
    host.setAttribute("role", "application");
    host.setAttribute("aria-label", "The run in three dimensions. Arrow keys move, plus and minus zoom.");
    stage.append(host);
    // The plan below is not meant.
    for (const name of ["pointerdown", "pointermove", "pointerup", "wheel"])
      host.addEventListener(name, (event) => event.stopPropagation());
    const { drawing, nodes, heights, weather } = ground;
    const made = new Scenery(host, drawing, new Heights(nodes, heights), window.devicePixelRatio);
    Object.assign(host, { drawn: made.stats });
    host.addEventListener("keydown", (event) => {
      if (steer(made, event.key)) event.preventDefault();
    });
    const fit = (): void => made.setSize({ width: stage.clientWidth, height: stage.clientHeight });
    fit();
    new ResizeObserver(fit).observe(stage);
    made.setWeather(weather);
    made.lookAt(replay.view(), TILT);
    return made;
  };
  choice.addEventListener("change", () => {
    const camera = isCamera(choice.value) ? choice.value : null;
    if (camera && !scenery) {
      try {
        scenery = make();
      } catch {
        host?.remove();
        choice.value = "plan";
        choice.disabled = true;
        choice.title = "This browser cannot show three dimensions.";
        return;
      }
    }
    if (host) host.hidden = camera === null;
    delete replay.seen;
    if (camera && scenery) {
      const made = scenery;
      made.setCamera(camera);
      replay.seen = (bodies, heads) => {
        made.setMoving(movingOf(bodies));
        made.setHeads(heads);
      };
    }
    replay.draw();
  });
}

function movingOf(bodies: readonly Body[]): Moving {
  const pose = new Float64Array(5 * bodies.length);
  bodies.forEach(({ x, y, hdg, length, width }, row) => pose.set([x, y, hdg, length, width], 5 * row));
  const [ego, first] = [
    bodies.findIndex((one) => one.ego),
    bodies.findIndex(({ category }) => category !== "pedestrian"),
  ];
  return {
    count: bodies.length,
    pose,
    category: Uint8Array.from(bodies, ({ category }) => Math.max(CATEGORIES.indexOf(category), 0)),
    flags: new Uint8Array(bodies.length),
    ego,
    followed: ego < 0 ? first : ego,
  };
}

const choice = document.getElementById("replay-view");
const ground = document.getElementById("replay-ground");
if (window.odscenReplay && choice instanceof HTMLSelectElement && ground)
  begin(window.odscenReplay, choice, JSON.parse(ground.textContent ?? "") as Ground);
