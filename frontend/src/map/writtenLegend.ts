import type { Palette } from "./colors";

/** A colour or sign on the map, and what it means. */
export interface LegendRow {
  color: string;
  words: string;
}

const ROW = 18;
const EDGE = 10;
const SWATCH = 11;

/** The rows of the legend that lies on the map now. */
export function legendRows(host: ParentNode = document): LegendRow[] {
  const rows = [...host.querySelectorAll(".map-legend span")];
  return rows.flatMap((row) => {
    const swatch = row.querySelector("i");
    const words = row.textContent.trim();
    if (!swatch || !words) return [];
    const { backgroundColor, borderTopColor, borderTopWidth } = getComputedStyle(swatch);
    return [{ words, color: parseFloat(borderTopWidth) > 0 ? borderTopColor : backgroundColor }];
  });
}

/** The legend at the bottom left, as on the page. */
export function drawLegend(
  context: CanvasRenderingContext2D,
  rows: readonly LegendRow[],
  palette: Palette,
  height: number,
): void {
  if (rows.length === 0) return;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "middle";
  const widest = Math.max(...rows.map(({ words }) => context.measureText(words).width));
  const top = height - rows.length * ROW - 2 * EDGE;
  context.beginPath();
  context.roundRect(EDGE, top - EDGE, widest + SWATCH + 3 * EDGE, rows.length * ROW + 2 * EDGE, 6);
  context.fillStyle = palette.paper;
  context.fill();
  rows.forEach(({ color, words }, n) => {
    const y = top + (n + 0.5) * ROW;
    context.beginPath();
    context.roundRect(2 * EDGE, y - SWATCH / 2, SWATCH, SWATCH, 3);
    context.fillStyle = color;
    context.fill();
    context.fillStyle = palette.ink;
    context.fillText(words, 2 * EDGE + SWATCH + EDGE, y);
  });
}
