import { expect, test } from "vitest";

import type { RecordingInfo } from "../src/api/recordings";
import { mostAtOnce, RecordedMoments } from "../src/recordings/moments";

const user = { id: "a", category: "car" as const, kind: null, begin: 0, end: 100, length: 4.5, width: 1.8 };
// 250,000 rows in each second: a part is as short as parts get, 4 s.
const info = {
  name: "r",
  begin: 0,
  end: 100,
  step: 0.000_004,
  origin: [10, 20],
  users: [user],
} as unknown as RecordingInfo;

/** One road user at two moments of a part, at x = 10 + its begin. */
function packed(begin: number): ArrayBuffer {
  const data = new ArrayBuffer(8 + 16 + 12 + 40);
  const view = new DataView(data);
  view.setUint32(0, 2, true);
  view.setUint32(4, 2, true);
  [begin, begin + 4].forEach((time, k) => view.setFloat64(8 + 8 * k, time, true));
  [0, 1, 2].forEach((first, k) => view.setUint32(24 + 4 * k, first, true));
  [0, begin, 0, 0, 1, 0, begin + 4, 0, 0, 1].forEach((value, k) => view.setFloat32(36 + 4 * k, value, true));
  return data;
}

const settled = (): Promise<void> => new Promise((done) => setTimeout(done));

test("of the parts that are passed by only the one that is looked at last is fetched", async () => {
  const asked: number[] = [];
  const answers: (() => void)[] = [];
  const load = (url: string): Promise<ArrayBuffer> => {
    const begin = Number(new URL(url, "http://host").searchParams.get("begin"));
    asked.push(begin);
    return new Promise((done) => answers.push(() => done(packed(begin))));
  };
  const moments = new RecordedMoments(
    info,
    () => undefined,
    (error) => expect.fail(String(error)),
    load,
  );
  expect(moments.at(50)).toBeNull();
  answers.shift()?.();
  await settled();
  expect(asked).toEqual([0, 48]);
  for (const time of [10, 20, 30, 90]) expect(moments.at(time)?.frame.count).toBe(1);
  expect(asked).toEqual([0, 48]);
  answers.shift()?.();
  await settled();
  expect(asked).toEqual([0, 48, 88]);
  answers.shift()?.();
  await settled();
  const shown = moments.at(90);
  expect((shown?.frame.rows[1] ?? NaN) + (shown?.crowd.origin[0] ?? NaN)).toBeCloseTo(10 + 90, 3);
});

test("the most at once are those of one time, not of a part of the bar", () => {
  const from = (begin: number, end: number) => ({ ...user, begin, end });
  expect(mostAtOnce([from(0, 10), from(11, 20), from(12, 30), from(20, 21)])).toBe(3);
  expect(mostAtOnce([])).toBe(0);
});
