/** Digits of coordinates in pixels: a hundredth is finer than any screen or printer. */
const DIGITS = 2;
/** Digits of coordinates on the ground, which are made larger. */
const GROUND_DIGITS = 3;

type Matrix = readonly [number, number, number, number, number, number];
/** Makes an empty path, or one from the words of SVG. */
export type PathMaker = (words?: string) => Path2D;

const IDENTITY: Matrix = [1, 0, 0, 1, 0, 0];
const escaped = (text: string): string =>
  text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");

/** A path that can be written down; what the map is drawn of, and no more. */
class WrittenPath {
  words: string;
  constructor(words = "") {
    this.words = words;
  }

  moveTo(x: number, y: number): void {
    this.words += `M${short(x)} ${short(y)}`;
  }

  lineTo(x: number, y: number): void {
    this.words += `${this.words ? "L" : "M"}${short(x)} ${short(y)}`;
  }

  closePath(): void {
    this.words += "Z";
  }

  rect(x: number, y: number, width: number, height: number): void {
    this.words += `M${short(x)} ${short(y)}h${short(width)}v${short(height)}h${short(-width)}Z`;
  }

  roundRect(x: number, y: number, width: number, height: number, radius: number): void {
    const r = Math.min(radius, width / 2, height / 2);
    const corner = (dx: number, dy: number): string =>
      `a${short(r)} ${short(r)} 0 0 1 ${short(dx)} ${short(dy)}`;
    this.words +=
      `M${short(x + r)} ${short(y)}h${short(width - 2 * r)}${corner(r, r)}v${short(height - 2 * r)}` +
      `${corner(-r, r)}h${short(2 * r - width)}${corner(-r, -r)}v${short(2 * r - height)}${corner(r, -r)}Z`;
  }

  /** Clockwise on the screen, as all arcs of the map are. */
  arc(x: number, y: number, r: number, from: number, to: number): void {
    const at = (angle: number): string =>
      `${short(x + r * Math.cos(angle))} ${short(y + r * Math.sin(angle))}`;
    const bend = `A${short(r)} ${short(r)} 0`;
    // A whole circle has its end where it begins, which SVG leaves out: it is two halves.
    const middle = (from + to) / 2;
    const begun = this.words && !this.words.endsWith("Z") ? "L" : "M";
    this.words += `${begun}${at(from)}${bend} 0 1 ${at(middle)}${bend} 0 1 ${at(to)}`;
  }
}

const short = (value: number): string => String(Number(value.toFixed(GROUND_DIGITS)));

/** Paths for drawings that are written down. */
export const writtenPath: PathMaker = (words) => new WrittenPath(words) as unknown as Path2D;
/** Paths for a screen. */
export const screenPath: PathMaker = (words) => (words === undefined ? new Path2D() : new Path2D(words));

interface Look {
  fillStyle: string;
  strokeStyle: string;
  lineWidth: number;
  lineCap: string;
  lineJoin: string;
  globalAlpha: number;
  font: string;
  textAlign: string;
  textBaseline: string;
  dash: readonly number[];
  matrix: Matrix;
}

const PLAIN: Look = {
  fillStyle: "#000000",
  strokeStyle: "#000000",
  lineWidth: 1,
  lineCap: "butt",
  lineJoin: "miter",
  globalAlpha: 1,
  font: "10px sans-serif",
  textAlign: "start",
  textBaseline: "alphabetic",
  dash: [],
  matrix: IDENTITY,
};

/** Takes the place of the context of a canvas, and writes what is drawn as SVG. */
class SvgContext implements Omit<Look, "dash" | "matrix"> {
  fillStyle = PLAIN.fillStyle;
  strokeStyle = PLAIN.strokeStyle;
  lineWidth = PLAIN.lineWidth;
  lineCap = PLAIN.lineCap;
  lineJoin = PLAIN.lineJoin;
  globalAlpha = PLAIN.globalAlpha;
  font = PLAIN.font;
  textAlign = PLAIN.textAlign;
  textBaseline = PLAIN.textBaseline;
  readonly parts: string[] = [];
  private dash: readonly number[] = [];
  private matrix: Matrix = IDENTITY;
  private path = new WrittenPath();
  private readonly saved: Look[] = [];

  constructor(readonly canvas: { width: number; height: number }) {}

  save(): void {
    const { fillStyle, strokeStyle, lineWidth, lineCap, lineJoin, globalAlpha } = this;
    const { font, textAlign, textBaseline, dash, matrix } = this;
    this.saved.push({
      ...{ fillStyle, strokeStyle, lineWidth, lineCap, lineJoin, globalAlpha },
      ...{ font, textAlign, textBaseline, dash, matrix },
    });
  }

  restore(): void {
    Object.assign(this, this.saved.pop());
  }

  setTransform(...matrix: Matrix): void {
    this.matrix = matrix;
  }

  translate(x: number, y: number): void {
    this.multiply([1, 0, 0, 1, x, y]);
  }

  rotate(angle: number): void {
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    this.multiply([cos, sin, -sin, cos, 0, 0]);
  }

  scale(x: number, y: number): void {
    this.multiply([x, 0, 0, y, 0, 0]);
  }

  setLineDash(dash: readonly number[]): void {
    this.dash = dash;
  }

  /** Nothing is below. */
  clearRect(): void {
    return;
  }

  beginPath(): void {
    this.path = new WrittenPath();
  }

  moveTo(x: number, y: number): void {
    this.path.moveTo(x, y);
  }

  lineTo(x: number, y: number): void {
    this.path.lineTo(x, y);
  }

  closePath(): void {
    this.path.closePath();
  }

  rect(x: number, y: number, width: number, height: number): void {
    this.path.rect(x, y, width, height);
  }

  roundRect(x: number, y: number, width: number, height: number, radius: number): void {
    this.path.roundRect(x, y, width, height, radius);
  }

  arc(x: number, y: number, r: number, from: number, to: number): void {
    this.path.arc(x, y, r, from, to);
  }

  fillRect(x: number, y: number, width: number, height: number): void {
    const path = new WrittenPath();
    path.rect(x, y, width, height);
    this.write(path, `fill="${this.fillStyle}"`);
  }

  fill(path?: WrittenPath | string, rule?: string): void {
    const odd = rule === "evenodd" ? ' fill-rule="evenodd"' : "";
    this.write(path instanceof WrittenPath ? path : this.path, `fill="${this.fillStyle}"${odd}`);
  }

  stroke(path?: WrittenPath): void {
    const dash = this.dash.length > 0 ? ` stroke-dasharray="${this.dash.map(short).join(" ")}"` : "";
    this.write(
      path ?? this.path,
      `fill="none" stroke="${this.strokeStyle}" stroke-width="${Number(this.lineWidth.toPrecision(4))}"` +
        ` stroke-linecap="${this.lineCap}" stroke-linejoin="${this.lineJoin}"${dash}`,
    );
  }

  fillText(text: string, x: number, y: number): void {
    this.letter(text, x, y, `fill="${this.fillStyle}"`);
  }

  strokeText(text: string, x: number, y: number): void {
    const line = `stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" stroke-linejoin="${this.lineJoin}"`;
    this.letter(text, x, y, `fill="none" ${line}`);
  }

  private letter(text: string, x: number, y: number, look: string): void {
    const anchor = { center: "middle", right: "end" }[this.textAlign] ?? "start";
    const base = this.textBaseline === "middle" ? ' dominant-baseline="central"' : "";
    this.parts.push(
      `<text x="${short(x)}" y="${short(y)}" ${look} style="font:${escaped(this.font)}"` +
        ` text-anchor="${anchor}"${base}${this.shared()}>${escaped(text)}</text>`,
    );
  }

  measureText(text: string): { width: number } {
    const context = document.createElement("canvas").getContext("2d");
    if (!context) return { width: 0 };
    context.font = this.font;
    return context.measureText(text);
  }

  private write(path: WrittenPath, look: string): void {
    if (path.words) this.parts.push(`<path d="${path.words}" ${look}${this.shared()}/>`);
  }

  private shared(): string {
    const alpha = this.globalAlpha === 1 ? "" : ` opacity="${short(this.globalAlpha)}"`;
    const numbers = this.matrix.map((value) => Number(value.toFixed(DIGITS + 4)));
    const moved = this.matrix.every((value, n) => value === IDENTITY[n]);
    return alpha + (moved ? "" : ` transform="matrix(${numbers.join(" ")})"`);
  }

  private multiply([a, b, c, d, e, f]: Matrix): void {
    const [A, B, C, D, E, F] = this.matrix;
    this.matrix = [
      A * a + C * b,
      B * a + D * b,
      A * c + C * d,
      B * c + D * d,
      A * e + C * f + E,
      B * e + D * f + F,
    ];
  }
}

/** What `draw` draws on a canvas of this size, as an SVG file. */
export function writtenPicture(
  { width, height }: { width: number; height: number },
  draw: (context: CanvasRenderingContext2D) => void,
): string {
  const context = new SvgContext({ width, height });
  // It has all of a context that the map is drawn with; a test draws everything there is.
  draw(context as unknown as CanvasRenderingContext2D);
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}"` +
    ` viewBox="0 0 ${width} ${height}">${context.parts.join("\n")}</svg>\n`
  );
}
