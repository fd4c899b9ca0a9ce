// @vitest-environment happy-dom
import { screen, waitFor } from "@testing-library/react";
import { type RefObject, useLayoutEffect, useRef } from "react";
import { expect, test, vi } from "vitest";

import type { PackedDrawing } from "../../src/map/drawing";
import { MapCanvas, type MapHandle } from "../../src/map/MapCanvas";
import { EMPTY_SCENE } from "../../src/map/scene";
import type { View } from "../../src/map/view";
import { show } from "../page";

const NOTHING = { sizes: [], steps: [] };
const DRAWING: PackedDrawing = {
  format: "",
  version: 1,
  name: "empty",
  bounds: [-500, -500, 500, 500],
  areas: [],
  marks: [],
  symbols: [],
  buildings: NOTHING,
  parking_spaces: NOTHING,
  bars: NOTHING,
  crosswalks: NOTHING,
  stop_lines: NOTHING,
};

/** A map over which somebody is followed before it has been laid out. */
function Followed({ begin }: { begin: View | undefined }) {
  const handle: RefObject<MapHandle | null> = useRef(null);
  const place = useRef({ read: () => begin, write: vi.fn() });
  useLayoutEffect(() => handle.current?.centre(30, 40), []);
  return (
    <MapCanvas
      drawing={DRAWING}
      graph={null}
      picker={null}
      scene={EMPTY_SCENE}
      label="Map"
      handle={handle}
      place={place.current}
    />
  );
}

test("the place of a link is shown also if a road user is followed before the map is there", async () => {
  // Nothing is drawn here.
  vi.stubGlobal("Path2D", vi.fn());
  vi.spyOn(HTMLElement.prototype, "getBoundingClientRect").mockReturnValue(new DOMRect(0, 0, 800, 600));
  show(<Followed begin={{ x: 30, y: 40, scale: 15 }} />);
  await waitFor(() => expect(screen.getByRole("application").dataset["view"]).toBe("30 40 15"));
});
