import { i18n } from "@lingui/core";
import { afterEach, expect, test } from "vitest";

import { localized } from "../../src/language/localized";
import { fixed, parsed } from "../../src/language/numbers";
import { ALLOWED, prefer, read } from "../../src/language/preferences";
import {
  dayTime,
  fromShown,
  lengthText,
  parsedDayTime,
  roughLength,
  roundLength,
  shownAs,
  shownUnit,
  speedText,
  toShown,
} from "../../src/language/units";

afterEach(() => {
  prefer({ language: "en", speed: "km/h", length: "m", hours: 24 });
  i18n.loadAndActivate({ locale: "en", messages: {} });
});

/** Numbers that repeat themselves, from 0 to `most`. */
function* numbers(most: number): Generator<number> {
  for (let n = 0, seed = 7; n < 500; n++) {
    seed = (seed * 48_271) % 2_147_483_647;
    yield (most * seed) / 2_147_483_647;
  }
}

test("a quantity that is shown and read back is the same in every unit", () => {
  for (const speed of ALLOWED.speed)
    for (const length of ALLOWED.length) {
      prefer({ speed, length });
      for (const value of numbers(500)) {
        expect(fromShown(toShown(value, "speed"), "speed")).toBeCloseTo(value, 9);
        expect(fromShown(toShown(value, "length"), "length")).toBeCloseTo(value, 9);
      }
    }
});

test("every minute of a day is read back from what is shown, in 24 and in 12 hours", () => {
  for (const hours of ALLOWED.hours) {
    prefer({ hours });
    for (let clock = 0; clock < 86_400; clock += 60) expect(parsedDayTime(dayTime(clock))).toBe(clock);
  }
  expect(["17:05", "5:05 pm", "5:05 P.M."].map(parsedDayTime)).toEqual([61_500, 61_500, 61_500]);
  expect(["24:00", "13:00 pm", "7", "7:75"].map(parsedDayTime)).toEqual([null, null, null, null]);
});

test("miles and feet are what they are by definition", () => {
  prefer({ speed: "mph", length: "ft" });
  expect(speedText(0.44704 * 30)).toBe("30 mph");
  expect(lengthText(0.3048 * 12)).toBe("12 ft");
  expect(roughLength(1609.344 * 2.5)).toBe("2.5 mi");
  expect(shownAs(" km/h").scale * 1.609344).toBeCloseTo(1, 12);
  expect(shownAs(" m").scale * 0.3048).toBeCloseTo(1, 12);
  expect(shownAs(" s")).toEqual({ suffix: " s", scale: 1, digits: 0 });
});

test("the bar of a map's scale is 1, 2 or 5 of its unit and as long as may be", () => {
  for (const length of ALLOWED.length) {
    prefer({ length });
    for (const most of numbers(5000)) {
      if (most < 1) continue;
      const { metres, text } = roundLength(most);
      expect(text).toMatch(/^(0\.)?0*[125]0* (m|km|ft|mi)$/);
      expect(metres).toBeLessThanOrEqual(most * 1.000001);
      expect(metres).toBeGreaterThan(most / 5.3);
    }
  }
});

test("numbers have the sign of their language, and both signs can be typed", () => {
  expect(fixed(1234.5, 1)).toBe("1234.5");
  i18n.loadAndActivate({ locale: "de", messages: {} });
  expect(fixed(1234.5, 1)).toBe("1234,5");
  expect([parsed("12,5 km/h"), parsed("12.5")]).toEqual([12.5, 12.5]);
});

test("a table is made anew in another language or unit, and only then", () => {
  let made = 0;
  const table = localized(() => ({ made: ++made }));
  expect(table()).toBe(table());
  prefer({ speed: "mph" });
  expect(table().made).toBe(2);
  i18n.loadAndActivate({ locale: "de", messages: {} });
  expect(table().made).toBe(3);
});

test("what is remembered and no longer known is as at first", () => {
  const first = { language: "en", speed: "km/h", length: "m", hours: 24 };
  expect(read(null)).toEqual(first);
  expect(read("{")).toEqual(first);
  expect(read(null, ["fr-FR", "de-AT", "en"])).toEqual({ ...first, language: "de" });
  expect(read(null, ["fr", "xx"])).toEqual(first);
  expect(read('{"language":"en"}', ["de"])).toEqual(first);
  expect(read('{"language":"xx","speed":"mph","hours":"12"}')).toEqual({ ...first, speed: "mph" });
});

test("numbers with a unit of the document are shown in that of the reader, and come back as they were", () => {
  prefer({ speed: "mph", length: "ft" });
  const [speed, length, time] = ["m/s", "m", "s"].map(shownUnit);
  expect([speed?.sign, length?.sign, time?.sign]).toEqual(["mph", "ft", "s"]);
  expect(speed?.shown(speed.kept(30))).toBe(30);
  expect(length?.shown(3.048)).toBe(10);
  expect(length?.kept(10)).toBeCloseTo(3.048, 12);
  expect([time?.shown(2.5), time?.kept(2.5)]).toEqual([2.5, 2.5]);
});
