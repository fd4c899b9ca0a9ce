// @vitest-environment happy-dom
import { i18n } from "@lingui/core";
import { I18nProvider } from "@lingui/react";
import { MantineProvider } from "@mantine/core";
import { cleanup, render } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, expect, test } from "vitest";

import { CATEGORIES } from "../../src/api/types";
import { Legend as EditorLegend } from "../../src/editor/Legend";
import { STEPS } from "../../src/editor/scene";
import { MARK_COLOR } from "../../src/map/colors";
import type { MarkKind } from "../../src/map/scene";
import { sequential } from "../../src/run/laneUse";
import { Legend } from "../../src/run/Legend";
import { SCALES } from "../../src/run/tint";

/** Least difference of two colours of one legend, CIEDE2000; 2 is just seen, 10 at a glance. */
const APART = 10;
/** Of white signs on a colour (WCAG 2.2, 1.4.3). */
const CONTRAST = 4.5;

const linear = (hex: string): number[] =>
  [1, 3, 5].map((at) => {
    const c = parseInt(hex.slice(at, at + 2), 16) / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
const dot = (a: readonly number[], b: readonly number[]): number =>
  a.reduce((sum, one, n) => sum + one * (b[n] ?? 0), 0);
const LUMINANCE = [0.2126729, 0.7151522, 0.072175];

/** CIELAB of an sRGB colour at D65. */
function lab(hex: string): [number, number, number] {
  const rgb = linear(hex);
  const f = (value: number): number =>
    value > 216 / 24389 ? Math.cbrt(value) : ((24389 / 27) * value + 16) / 116;
  const x = f(dot(rgb, [0.4124564, 0.3575761, 0.1804375]) / 0.95047);
  const y = f(dot(rgb, LUMINANCE));
  const z = f(dot(rgb, [0.0193339, 0.119192, 0.9503041]) / 1.08883);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/** CIEDE2000 (Sharma, Wu, Dalal 2005) of two colours such as `#1971c2`. */
function difference(one: string, other: string): number {
  const [L1, a1, b1] = lab(one);
  const [L2, a2, b2] = lab(other);
  const rad = Math.PI / 180;
  const mean = (Math.hypot(a1, b1) + Math.hypot(a2, b2)) / 2;
  const G = 0.5 * (1 - Math.sqrt(mean ** 7 / (mean ** 7 + 25 ** 7)));
  const [A1, A2] = [(1 + G) * a1, (1 + G) * a2];
  const [C1, C2] = [Math.hypot(A1, b1), Math.hypot(A2, b2)];
  const hue = (a: number, b: number): number =>
    a === 0 && b === 0 ? 0 : (Math.atan2(b, a) / rad + 360) % 360;
  const [h1, h2] = [hue(A1, b1), hue(A2, b2)];
  const turn = C1 * C2 === 0 ? 0 : ((h2 - h1 + 540) % 360) - 180;
  const dH = 2 * Math.sqrt(C1 * C2) * Math.sin((turn / 2) * rad);
  const [L, C] = [(L1 + L2) / 2, (C1 + C2) / 2];
  const h = C1 * C2 === 0 ? h1 + h2 : h1 + turn / 2;
  const T =
    1 -
    0.17 * Math.cos((h - 30) * rad) +
    0.24 * Math.cos(2 * h * rad) +
    0.32 * Math.cos((3 * h + 6) * rad) -
    0.2 * Math.cos((4 * h - 63) * rad);
  const SL = 1 + (0.015 * (L - 50) ** 2) / Math.sqrt(20 + (L - 50) ** 2);
  const [SC, SH] = [1 + 0.045 * C, 1 + 0.015 * C * T];
  const away = (((h % 360) + 360) % 360) - 275;
  const RT = -Math.sin(60 * Math.exp(-((away / 25) ** 2)) * rad) * 2 * Math.sqrt(C ** 7 / (C ** 7 + 25 ** 7));
  const [l, c, k] = [(L2 - L1) / SL, (C2 - C1) / SC, dH / SH];
  return Math.sqrt(l * l + c * c + k * k + RT * c * k);
}

const hex = (color: string): string => {
  const rgb = /rgb\((\d+), (\d+), (\d+)\)/.exec(color);
  const found = /#[0-9a-f]{6}/i.exec(color)?.[0];
  return (
    found ?? `#${(rgb?.slice(1) ?? []).map((one) => Number(one).toString(16).padStart(2, "0")).join("")}`
  );
};

/** The colours of a legend as it is shown, by what they mean. */
function colours(part: ReactNode, scheme: "light" | "dark"): Map<string, string> {
  const { container } = render(
    <I18nProvider i18n={i18n}>
      <MantineProvider env="test" forceColorScheme={scheme}>
        {part}
      </MantineProvider>
    </I18nProvider>,
  );
  const found = new Map<string, string>();
  for (const swatch of container.querySelectorAll<HTMLElement>(".map-legend i")) {
    const color = swatch.style.border || swatch.style.background;
    if (color !== "transparent") found.set(swatch.closest("span")?.textContent ?? "", hex(color));
  }
  cleanup();
  return found;
}

/** Pairs of a legend that are too much alike. */
function alike(legend: ReadonlyMap<string, string>): string[] {
  const all = [...legend];
  return all.flatMap(([word, color], n) =>
    all.slice(n + 1).flatMap(([other, its]) => {
      const apart = difference(color, its);
      return apart < APART ? [`${word} ${color} and ${other} ${its}: ${apart.toFixed(1)}`] : [];
    }),
  );
}

afterEach(cleanup);

const SCHEMES = ["light", "dark"] as const;
const MARKS = Object.keys(MARK_COLOR) as MarkKind[];
const ALL = { ego: true, lights: true, lamps: true, marks: new Set(MARKS) };

test("the difference of colours is that of the paper, and such as eyes see", () => {
  expect(difference("#ffffff", "#ffffff")).toBe(0);
  expect(difference("#ffffff", "#000000")).toBeCloseTo(100, 1);
  expect(difference("#b8500b", "#b45309")).toBeCloseTo(1.7, 1);
});

test.each(SCHEMES)("each colour of the legend of a run is told from all others, %s", (scheme) => {
  const legend = colours(<Legend categories={new Set(CATEGORIES)} {...ALL} />, scheme);
  expect(legend.size).toBe(CATEGORIES.length + 1 + 2 + MARKS.length);
  expect(alike(legend)).toEqual([]);
});

test.each(SCHEMES)("so is each of the legends of the steps of the editor, %s", (scheme) => {
  const legends = STEPS.map((step) => colours(<EditorLegend step={step} />, scheme));
  expect(legends.filter(({ size }) => size > 1).length).toBeGreaterThanOrEqual(2);
  expect(legends.flatMap(alike)).toEqual([]);
});

test.each(SCHEMES)("so are the steps of each scale, and lanes without vehicles, %s", (scheme) => {
  const none = { ego: false, lights: false, lamps: false, marks: new Set<never>() };
  for (const by of ["speed", "delay", "signal", "lamps"] as const) {
    const legend = colours(<Legend categories={new Set(["car"])} {...none} by={by} />, scheme);
    expect(legend.size).toBe(SCALES()[by].colors.length);
    expect(alike(legend)).toEqual([]);
  }
  const words = ["a", "b", "c", "d", "e", "f"];
  const lanes = { word: "Delay", colors: sequential(words.length), words };
  const legend = colours(<Legend categories={new Set()} {...none} lanes={lanes} />, scheme);
  expect(legend.size).toBe(words.length + 1);
  expect(alike(legend)).toEqual([]);
});

test("white signs are read on the colours of marks", () => {
  for (const color of Object.values(MARK_COLOR))
    expect(1.05 / (dot(linear(color), LUMINANCE) + 0.05)).toBeGreaterThanOrEqual(CONTRAST);
});
