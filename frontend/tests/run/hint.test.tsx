// @vitest-environment happy-dom
import { screen } from "@testing-library/react";
import { expect, test } from "vitest";

import { drawGoal, drawWaypoint, spot } from "../../src/map/marks";
import { RunHint } from "../../src/run/RunHint";
import { show } from "../page";

test("a run that is being prepared says so, and how far it is, before any time passes", () => {
  const preparing = { state: "preparing", preparing: "iteration 3 of 20" } as const;
  const { again } = show(
    <RunHint lost={false} info={preparing} planned={false} followed={null} there={false} />,
  );
  expect(screen.getByRole("status").textContent).toBe(
    "Preparing, step 1 of 2: planning the routes … iteration 3 of 20",
  );
  again(<RunHint lost={false} info={preparing} planned followed={null} there={false} />);
  expect(screen.getByRole("status").textContent).toContain("step 2 of 2");
  const running = { state: "running", preparing: null } as const;
  again(<RunHint lost={false} info={running} planned followed={null} there={false} />);
  expect(screen.queryByRole("status")).toBeNull();
  again(<RunHint lost={false} info={running} planned followed="car-1" there={false} />);
  expect(screen.getByRole("status").textContent).toBe("car-1 is not on the road now.");
});

/** The shapes that are put on a canvas, by the calls that make them. */
function shapes(draw: (context: CanvasRenderingContext2D) => void): string[] {
  const calls: string[] = [];
  const context = new Proxy({} as CanvasRenderingContext2D, {
    get: (_, name) => () => calls.push(String(name)),
    set: () => true,
  });
  draw(context);
  return calls.filter((name) => ["arc", "lineTo", "roundRect"].includes(name));
}

test("starts are round, suggested goals are diamonds, waypoints squares, whatever their colour", () => {
  expect(shapes((context) => spot(context, [0, 0], "red"))).toEqual(["arc"]);
  expect(shapes((context) => drawGoal(context, [0, 0], false))).toEqual(["lineTo", "lineTo", "lineTo"]);
  expect(shapes((context) => drawWaypoint(context, [0, 0], 1))).toEqual(["roundRect"]);
});
