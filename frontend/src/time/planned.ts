import type { components } from "../api/schema";
import { CATEGORIES } from "../api/types";
import { nth } from "../lists";
import type { Moving } from "../map/scene";

export type PlannedColumns = components["schemas"]["PlannedColumns"];

/** Where road users are planned to be: each alone on the road, at the speed that it wants. */
export class Planned {
  /** Seconds that each is planned to travel, by its id. */
  readonly durations: ReadonlyMap<string, number>;

  constructor(private readonly columns: PlannedColumns) {
    const { users, first, time } = columns;
    this.durations = new Map(
      users.map(({ id }, n) => [id, nth(time, nth(first, n + 1) - 1) - nth(time, nth(first, n))]),
    );
  }

  get leftOut(): readonly string[] {
    return this.columns.left_out;
  }

  get notPlanned(): number {
    return this.columns.not_planned;
  }

  /** Ids of the road users that are on the road, in the order of {@link at}; of a member that of its flow. */
  there(at: number): string[] {
    const { users } = this.columns;
    return this.rowsAt(at).map((n) => nth(users, n).flow ?? nth(users, n).id);
  }

  /** All on the road at a time, as the moving layer draws them. */
  at(at: number, selected: string | null): Moving {
    const { users, first, time, x, y, hdg } = this.columns;
    const rows = this.rowsAt(at);
    const pose = new Float64Array(5 * rows.length);
    const category = new Uint8Array(rows.length);
    let [ego, followed] = [-1, -1];
    rows.forEach((n, k) => {
      const user = nth(users, n);
      const [low, high] = [nth(first, n), nth(first, n + 1) - 1];
      const a = lastUpTo(time, at, low, high);
      const b = Math.min(a + 1, high);
      const span = nth(time, b) - nth(time, a);
      const share = span > 0 ? Math.min(1, Math.max(0, (at - nth(time, a)) / span)) : 0;
      const turn = nth(hdg, b) - nth(hdg, a);
      const between = (of: readonly number[]): number => nth(of, a) + share * (nth(of, b) - nth(of, a));
      pose.set(
        [
          between(x),
          between(y),
          nth(hdg, a) + share * Math.atan2(Math.sin(turn), Math.cos(turn)),
          user.length,
          user.width,
        ],
        5 * k,
      );
      category[k] = Math.max(CATEGORIES.indexOf(user.category), 0);
      if (user.ego) ego = k;
      if (selected !== null && (user.flow ?? user.id) === selected) followed = k;
    });
    return { count: rows.length, pose, category, flags: new Uint8Array(rows.length), ego, followed };
  }

  private rowsAt(at: number): number[] {
    const { users, first, time } = this.columns;
    const rows: number[] = [];
    for (let n = 0; n < users.length; n++)
      if (nth(time, nth(first, n)) <= at && at <= nth(time, nth(first, n + 1) - 1)) rows.push(n);
    return rows;
  }
}

/** The last of the rising times from row `low` to row `high` that is not after `at`. */
function lastUpTo(times: readonly number[], at: number, low: number, high: number): number {
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (nth(times, middle) <= at) low = middle;
    else high = middle - 1;
  }
  return low;
}
