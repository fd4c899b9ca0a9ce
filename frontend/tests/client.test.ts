import { afterEach, expect, test, vi } from "vitest";

import { address, api, ApiError, call, form } from "../src/api/client";
import { demand } from "../src/api/demand";
import { runs } from "../src/api/runs";
import { type Sent, stubFetch } from "./requests";

afterEach(() => vi.unstubAllGlobals());

function asked(status: number, body: unknown): Sent[] {
  const found: Sent[] = [];
  stubFetch((sent) => {
    found.push(sent);
    return new Response(status === 204 ? null : JSON.stringify(body), { status });
  });
  return found;
}

test("names in an address are encoded, and files in folders keep their slashes", () => {
  expect(address("/api/runs/{run}/report.html", { params: { path: { run: "a b#1" } } })).toBe(
    "/api/runs/a%20b%231/report.html",
  );
  expect(runs.fileUrl("r-1", "figures/a b.csv")).toBe("/api/runs/r-1/files/figures/a%20b.csv");
  expect(api.downloadUrl("s", "graphml")).toBe("/api/scenarios/s/download?form=graphml");
});

test("what is not asked for is not in the address", async () => {
  const list = asked(200, []);
  await call("get", "/api/runs", { params: { query: { scenario: null } } });
  await runs.list("x y");
  expect(list.map(({ path }) => path)).toEqual(["/api/runs", "/api/runs?scenario=x%20y"]);
});

test("a body goes out as JSON, a form as a form, and no body as none", async () => {
  const list = asked(200, {});
  await api.undo("s", 3);
  expect(list[0]).toMatchObject({
    path: "/api/scenarios/s/undo?changes=true",
    body: { version: 3 },
    request: { method: "POST", keepalive: true },
  });
  await demand.table("s", 3, "od", new File(["a"], "a.csv"), null);
  const sent = list[1]?.body as FormData;
  expect([sent.get("version"), sent.get("kind"), sent.has("part")]).toEqual(["3", "od", false]);
  expect(list[1]?.request.keepalive).toBe(false);
  await api.maps();
  expect(list[2]).toMatchObject({ path: "/api/maps", body: undefined, request: { method: "GET" } });
  expect(list[2]?.request.headers.has("Content-Type")).toBe(false);
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
