import { t } from "@lingui/core/macro";

import { tell, tellError } from "./notices";
import { write } from "./kept";

/** Gives a file to the browser to be saved. */
export function saveFile(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  // The browser has opened it by the next minute.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Copies the address of what is seen now. */
export function copyLink(): void {
  write();
  const text = location.href;
  // Browsers give the clipboard only to pages that are served safely.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (!clipboard) return tell(t`The link to this view: ${text}`);
  clipboard
    .writeText(text)
    .then(
      () => tell(t`The link to this view is copied. It keeps map, step, selection and moment.`),
      tellError,
    );
}

/** Saves what a canvas shows as a picture. */
export function savePicture(canvas: HTMLCanvasElement, name: string): void {
  canvas.toBlob((blob) => {
    if (blob) saveFile(blob, `${name}.png`);
    else tell(t`The picture could not be made.`);
  }, "image/png");
}

/** Saves a drawing as an SVG file. */
export function saveVector(svg: string, name: string): void {
  saveFile(new Blob([svg], { type: "image/svg+xml" }), `${name}.svg`);
}

const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"] as const;
const FRAMES_PER_SECOND = 30;

/** A video that is being recorded. */
export interface Recording {
  /** Ends it; the answer is the file. */
  stop: () => Promise<Blob>;
}

/** Records what `draw` paints on a canvas with every picture of the screen; null where browsers cannot. */
export function record(draw: (canvas: HTMLCanvasElement) => void): Recording | null {
  const kind =
    typeof MediaRecorder === "undefined"
      ? undefined
      : KINDS.find((one) => MediaRecorder.isTypeSupported(one));
  if (!kind) return null;
  const canvas = document.createElement("canvas");
  draw(canvas);
  const recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_SECOND), { mimeType: kind });
  const parts: Blob[] = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  let pending = 0;
  const tick = (): void => {
    draw(canvas);
    pending = requestAnimationFrame(tick);
  };
  tick();
  recorder.start();
  return {
    stop: () =>
      new Promise((done) => {
        recorder.onstop = () => done(new Blob(parts, { type: "video/webm" }));
        cancelAnimationFrame(pending);
        recorder.stop();
      }),
  };
}
