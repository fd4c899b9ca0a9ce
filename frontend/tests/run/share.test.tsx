// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { beforeEach, expect, test, vi } from "vitest";

import { ShareMenu } from "../../src/run/ShareMenu";
import { show } from "../page";

const saved: string[] = [];
const recorders: FakeRecorder[] = [];

class FakeRecorder {
  static isTypeSupported = (kind: string): boolean => kind.endsWith("vp8");
  ondataavailable: ((event: { data: Blob }) => void) | null = null;
  onstop: (() => void) | null = null;
  constructor(
    readonly stream: unknown,
    readonly options: { mimeType: string },
  ) {
    recorders.push(this);
  }
  start(): void {
    this.ondataavailable?.({ data: new Blob(["film"]) });
  }
  stop(): void {
    this.onstop?.();
  }
}

beforeEach(() => {
  saved.length = recorders.length = 0;
  vi.stubGlobal("MediaRecorder", FakeRecorder);
  Object.assign(HTMLCanvasElement.prototype, { captureStream: () => "stream" });
  vi.spyOn(HTMLAnchorElement.prototype, "click").mockImplementation(function (this: HTMLAnchorElement) {
    saved.push(this.download);
  });
  vi.spyOn(HTMLCanvasElement.prototype, "toBlob").mockImplementation((take) => take(new Blob(["png"])));
});

const part = (playing: boolean | null, onPlay: () => void) => {
  const picture = (into?: HTMLCanvasElement): HTMLCanvasElement => into ?? document.createElement("canvas");
  const handle = { current: { picture } };
  return <ShareMenu run="r1" handle={handle} vector={() => "<svg/>"} playing={playing} onPlay={onPlay} />;
};
const item = async (user: ReturnType<typeof show>["user"], name: string): Promise<void> => {
  await user.click(screen.getByRole("button", { name: "Share" }));
  await user.click(await screen.findByRole("menuitem", { name }));
};

test("the picture of the map is saved under the name of the run", async () => {
  const { user } = show(part(null, vi.fn()));
  await item(user, "Picture of the map (PNG)");
  expect(saved).toEqual(["r1.png"]);
});

test("the drawing of the map is saved as a vector file", async () => {
  const { user } = show(part(null, vi.fn()));
  await item(user, "Drawing of the map (SVG)");
  expect(saved).toEqual(["r1.svg"]);
});

test("a video plays the recording and is saved when that has come to its end", async () => {
  const onPlay = vi.fn();
  const { user, again } = show(part(false, onPlay));
  await item(user, "Video of the map (WebM)");
  expect(onPlay).toHaveBeenCalledOnce();
  expect(recorders[0]?.options.mimeType).toBe("video/webm;codecs=vp8");
  again(part(true, onPlay));
  expect(saved).toEqual([]);
  again(part(false, onPlay));
  await screen.findByRole("button", { name: "Share" });
  await vi.waitFor(() => expect(saved).toEqual(["r1.webm"]));
});

test("a video of a live run is saved when it is stopped by hand", async () => {
  const { user } = show(part(null, vi.fn()));
  await item(user, "Video of the map (WebM)");
  await user.click(screen.getByRole("button", { name: "Stop and save the video" }));
  await vi.waitFor(() => expect(saved).toEqual(["r1.webm"]));
});

test("without a recorder in the browser nothing is recorded", async () => {
  vi.stubGlobal("MediaRecorder", undefined);
  const { user } = show(part(null, vi.fn()));
  await item(user, "Video of the map (WebM)");
  expect(screen.queryByRole("button", { name: "Stop and save the video" })).toBeNull();
});
