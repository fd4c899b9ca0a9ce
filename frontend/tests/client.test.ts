import { afterEach, expect, test, vi } from "vitest";

import { address, api, ApiError, call, form } from "../src/api/client";
import { demand } from "../src/api/demand";
import { runs } from "../src/api/runs";

afterEach(() => vi.unstubAllGlobals());

function asked(status: number, body: unknown): [url: string, init: RequestInit][] {
  const found: [string, RequestInit][] = [];
  vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
    found.push([url, init]);
    return Promise.resolve(new Response(status === 204 ? null : JSON.stringify(body), { status }));
  });
  return found;
}

test("names in an address are encoded, and files in folders keep their slashes", () => {
  expect(address("/api/runs/{run}/report.html", { path: { run: "a b#1" } })).toBe(
    "/api/runs/a%20b%231/report.html",
  );
  expect(runs.fileUrl("r-1", "figures/a b.csv")).toBe("/api/runs/r-1/files/figures/a%20b.csv");
  expect(api.downloadUrl("s", "graphml")).toBe("/api/scenarios/s/download?form=graphml");
});

test("what is not asked for is not in the address", async () => {
  const list = asked(200, []);
  await call("get", "/api/runs", { query: { scenario: null } });
  await runs.list("x y");
  expect(list.map(([url]) => url)).toEqual(["/api/runs", "/api/runs?scenario=x+y"]);
});

test("a body goes out as JSON, a form as a form, and no body as none", async () => {
  const list = asked(200, {});
  await api.undo("s", 3);
  expect(list[0]).toEqual([
    "/api/scenarios/s/undo?changes=true",
    {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      keepalive: true,
      body: '{"version":3}',
    },
  ]);
  await demand.table("s", 3, "od", new File(["a"], "a.csv"), null);
  const sent = list[1]?.[1].body as FormData;
  expect([sent.get("version"), sent.get("kind"), sent.has("part")]).toEqual(["3", "od", false]);
  expect(list[1]?.[1].headers).toEqual({});
  await api.maps();
  expect(list[2]?.[1]).toEqual({ method: "GET", headers: {}, body: null });
  expect([...form({ a: null, b: "1" }).keys()]).toEqual(["b"]);
});

test("an answer without a body is nothing, and a refusal is thrown in the server's words", async () => {
  asked(204, null);
  expect(await api.undo("s", 3)).toBeUndefined();
  asked(409, { error: { kind: "ConflictError", message: "it has changed", problems: [], current: 4 } });
  const error: unknown = await api.undo("s", 3).catch((reason: unknown) => reason);
  expect(error).toBeInstanceOf(ApiError);
  expect(error).toMatchObject({ status: 409, message: "it has changed", body: { current: 4 } });
  vi.stubGlobal("fetch", () => Promise.reject(new TypeError("failed")));
  await expect(api.maps()).rejects.toMatchObject({ status: 0, body: { kind: "offline" } });
});
