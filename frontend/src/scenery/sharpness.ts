/** Milliseconds that a picture may take before it is drawn with fewer pixels, and below which with more. */
const [SLOW, QUICK] = [28, 13];
/** How much coarser or finer the next try is. */
const STEP = 0.8;
/** Least share of the full number of pixels in a row. */
const LEAST = 0.5;
/** Pictures between two looks at the time; the first ones also build programs for the graphics. */
const [EVERY, FIRST] = [6, 4];

/** How many pixels a moving picture has, so that it moves; a still one has all. */
export class Sharpness {
  /** Pixels per CSS pixel while something moves. */
  ratio: number;
  private pictures = 0;

  constructor(readonly full: number) {
    this.ratio = full;
  }

  /** Whether the picture drawn now should be timed. */
  isDue(): boolean {
    this.pictures += 1;
    return this.pictures > FIRST && this.pictures % EVERY === 0;
  }

  /** Takes in how long a picture took, ms; true if the next has another number of pixels. */
  adapt(took: number): boolean {
    const before = this.ratio;
    if (took > SLOW) this.ratio = Math.max(LEAST * this.full, this.ratio * STEP);
    else if (took < QUICK) this.ratio = Math.min(this.full, this.ratio / STEP);
    return this.ratio !== before;
  }
}

/** Whether the browser draws without a graphics card: then edges are smoothed at too high a price. */
export function drawsInSoftware(gl: WebGL2RenderingContext | WebGLRenderingContext | null): boolean {
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = known ? String(gl?.getParameter(known.UNMASKED_RENDERER_WEBGL)) : "";
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
