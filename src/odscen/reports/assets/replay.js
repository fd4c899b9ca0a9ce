"use strict";
(() => {
  const holder = document.getElementById("replay-stage");
  if (!holder) return;
  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const map = document.getElementById("replay-map");
  const canvas = document.getElementById("replay-canvas");
  const [play, bar, speed, clock, whole] = ["play", "bar", "speed", "clock", "whole"].map((name) =>
    document.getElementById(`replay-${name}`),
  );
  const style = getComputedStyle(document.documentElement);
  const colours = new Map();
  const colourOf = (category) => {
    if (!colours.has(category)) colours.set(category, style.getPropertyValue(`--${category}`) || "#777");
    return colours.get(category);
  };
  for (const piece of data.pieces) {
    const at = [0, 0, 0];
    piece.places = Float64Array.from(piece.moves, (move, index) => (at[index % 3] += move));
    piece.last = piece.frame + piece.places.length / 3 - 1;
    delete piece.moves;
  }
  const first = map.getAttribute("viewBox").split(" ").map(Number);
  let view = [...first];
  let time = 0;
  let running = false;
  let before = 0;
  const last = Math.max(data.frames - 1, 0);
  bar.max = String(last);

  const timeWords = (seconds) => {
    const all = data.clock ? data.clock + seconds : seconds;
    const two = (value) => String(Math.floor(value)).padStart(2, "0");
    const [hours, minutes, rest] = [Math.floor(all / 3600) % 24, (all / 60) % 60, all % 60];
    if (data.clock) return `${hours}:${two(minutes)}:${two(rest)}`;
    return `${Math.floor(all / 60)}:${two(rest)}.${Math.floor((all * 10) % 10)}`;
  };
  const SHOWN = { G: "green", g: "green", s: "green", y: "yellow", Y: "yellow", u: "yellow", r: "red", R: "red" };
  const COLOURS = { green: "#1a9850", yellow: "#f2b600", red: "#d73027" };
  const stateAt = (light, seconds) => {
    let [low, high] = [0, light.times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (light.times[middle] <= seconds + 1e-6) low = middle + 1;
      else high = middle;
    }
    return low ? light.states[low - 1] : null;
  };
  // Across the lane is stop, along it is go: to be told without colours, too.
  const headsAt = (seconds) => {
    const heads = [];
    for (const light of data.lights) {
      const state = stateAt(light, seconds);
      if (state === null) continue;
      for (const [x, y, hdg, letters] of light.heads) {
        const seen = letters.map((letter) => SHOWN[state[letter]]);
        const shown = ["green", "yellow", "red"].find((colour) => seen.includes(colour));
        if (shown) heads.push({ x: x / 100, y: y / 100, hdg, walk: false, shown });
      }
    }
    return heads;
  };
  const drawHeads = (context, place, scale, seconds) => {
    const long = Math.max(260 * scale, 7);
    const thick = Math.max(70 * scale, 2.5);
    for (const { x, y, hdg, shown } of headsAt(seconds)) {
      place(100 * x, 100 * y, hdg);
      context.fillStyle = COLOURS[shown];
      if (shown === "green") context.fillRect(0, -thick / 2, long, thick);
      else context.fillRect(-thick / 2, -long / 2, thick, long);
    }
  };
  // A view in three dimensions gets each moment from here.
  const replay = (window.odscenReplay = {
    stage: holder,
    draw: () => draw(),
    view: () => ({
      x: (view[0] + view[2] / 2) / 100,
      y: -(view[1] + view[3] / 2) / 100,
      scale: 100 * Math.min(holder.clientWidth / view[2], holder.clientHeight / view[3]),
    }),
  });
  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    const [wide, high] = [holder.clientWidth, holder.clientHeight];
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
      canvas.width = Math.round(wide * ratio);
      canvas.height = Math.round(high * ratio);
    }
    map.setAttribute("viewBox", view.join(" "));
    const scale = Math.min(wide / view[2], high / view[3]);
    const left = wide / 2 - (view[0] + view[2] / 2) * scale;
    const top = high / 2 - (view[1] + view[3] / 2) * scale;
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const frame = Math.floor(time);
    const share = time - frame;
    const place = (x, y, heading) => {
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.translate(left + x * scale, top - y * scale);
      context.rotate(-heading);
    };
    drawHeads(context, place, scale, data.begin + time * data.step);
    let shown = 0;
    const bodies = [];
    for (const piece of data.pieces) {
      if (time < piece.frame || time > piece.last) continue;
      const row = (frame - piece.frame) * 3;
      const next = Math.min(row + 3, piece.places.length - 3);
      const between = (index) => piece.places[row + index] * (1 - share) + piece.places[next + index] * share;
      const [x, y, hdg] = [between(0), between(1), between(2) / 100];
      place(x, y, hdg);
      const { category, ego, length: long, width: wide } = piece;
      bodies.push({ category, ego: ego === true, x: x / 100, y: y / 100, hdg, length: long, width: wide });
      const length = Math.max(piece.length * 100 * scale, 4);
      const width = Math.max(piece.width * 100 * scale, 3);
      context.fillStyle = colourOf(piece.category);
      context.fillRect(-length / 2, -width / 2, length, width);
      context.fillStyle = "rgba(0, 0, 0, 0.45)";
      context.fillRect(length * 0.15, -width / 2, length * 0.15, width);
      shown += 1;
    }
    bar.value = String(Math.round(time));
    const words = timeWords(data.begin + time * data.step);
    clock.textContent = words;
    bar.setAttribute("aria-valuetext", words);
    holder.dataset.shown = String(shown);
    holder.dataset.time = String(time * data.step);
    replay.seen?.(bodies, headsAt(data.begin + time * data.step));
  };
  const name = () => {
    play.textContent = running ? "Pause" : "Play";
  };
  const tick = (now) => {
    if (!running) return;
    time += ((now - before) / 1000 / data.step) * Number(speed.value);
    before = now;
    if (time >= last) {
      time = last;
      running = false;
      name();
    }
    draw();
    requestAnimationFrame(tick);
  };
  play.addEventListener("click", () => {
    running = !running;
    if (running && time >= last) time = 0;
    before = performance.now();
    name();
    requestAnimationFrame(tick);
  });
  bar.addEventListener("input", () => {
    time = Number(bar.value);
    draw();
  });
  whole.addEventListener("click", () => {
    view = [...first];
    draw();
  });
  const zoom = (factor, x, y) => {
    const scale = Math.min(holder.clientWidth / view[2], holder.clientHeight / view[3]);
    const px = view[0] + view[2] / 2 + (x - holder.clientWidth / 2) / scale;
    const py = view[1] + view[3] / 2 + (y - holder.clientHeight / 2) / scale;
    view = [px + (view[0] - px) * factor, py + (view[1] - py) * factor, view[2] * factor, view[3] * factor];
    draw();
  };
  for (const [id, factor] of [["replay-in", 0.7], ["replay-out", 1 / 0.7]]) {
    document.getElementById(id).addEventListener("click", () => {
      zoom(factor, holder.clientWidth / 2, holder.clientHeight / 2);
    });
  }
  holder.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, event.offsetX, event.offsetY);
  }, { passive: false });
  let grip = null;
  holder.addEventListener("pointerdown", (event) => {
    grip = [event.clientX, event.clientY];
    holder.setPointerCapture(event.pointerId);
  });
  holder.addEventListener("pointermove", (event) => {
    if (!grip) return;
    const scale = Math.min(holder.clientWidth / view[2], holder.clientHeight / view[3]);
    view[0] -= (event.clientX - grip[0]) / scale;
    view[1] -= (event.clientY - grip[1]) / scale;
    grip = [event.clientX, event.clientY];
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) holder.addEventListener(end, () => (grip = null));
  new ResizeObserver(draw).observe(holder);
  draw();
})();
