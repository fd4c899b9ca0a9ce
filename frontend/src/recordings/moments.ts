import { recordings, type RecordingInfo } from "../api/recordings";
import type { Crowd, Frame } from "../run/frames";
import { type MovedColumns, Replay } from "../run/replay";

const HEAD = 8;
const COLUMNS = 5;
/** Rows of the whole recording that are fetched first, and of a part. */
const MOST_OVERVIEW = 200_000;
const MOST_PART = 150_000;
/** Parts that are kept. */
const KEPT = 12;
/** Rows that a part is to have, of which its seconds follow. */
const ROWS_OF_PART = 60_000;
const SHORTEST_PART = 4;

type Users = RecordingInfo["users"];

/** Reads moments as the server packs them: two numbers, times, first rows, and five numbers a row. */
export function unpackMoments(
  data: ArrayBuffer,
  users: Users,
  origin: readonly [number, number],
): MovedColumns {
  const head = new DataView(data);
  const [moments, rows] = [head.getUint32(0, true), head.getUint32(4, true)];
  const size = HEAD + 8 * moments + 4 * (moments + 1) + 4 * COLUMNS * rows;
  if (data.byteLength !== size)
    throw new Error(`${data.byteLength} bytes are not those of ${moments} moments with ${rows} rows`);
  const times = new Float64Array(data.slice(HEAD, HEAD + 8 * moments));
  const first = new Uint32Array(data.slice(HEAD + 8 * moments, HEAD + 8 * moments + 4 * (moments + 1)));
  const all = new Float32Array(data.slice(size - 4 * COLUMNS * rows));
  const column = (k: number, from = 0): Float64Array => {
    const found = new Float64Array(rows);
    for (let row = 0; row < rows; row++) found[row] = (all[COLUMNS * row + k] ?? 0) + from;
    return found;
  };
  return {
    times,
    first,
    actor: column(0),
    x: column(1, origin[0]),
    y: column(2, origin[1]),
    hdg: column(3),
    speed: column(4),
    actors: users.map(({ id, category, length, width }) => ({ id, category, length, width, ego: false })),
  };
}

/**
 * Where road users of a recording were: all of it with fewer moments, so that any can be shown at once,
 * and the parts that are looked at with all moments.
 */
export class RecordedMoments {
  private overview: Replay | null = null;
  private readonly parts = new Map<number, Replay>();
  private readonly seconds: number;
  /** The part that is looked at now, and whether one is being fetched: of those passed by none is. */
  private wanted = -1;
  private fetching = false;

  constructor(
    private readonly info: RecordingInfo,
    /** A part has come that may be in sight. */
    private readonly onPart: () => void,
    private readonly onError: (error: unknown) => void,
    private readonly load: (url: string) => Promise<ArrayBuffer> = fetched,
  ) {
    const rows = info.users.reduce((sum, { begin, end }) => sum + (end - begin) / info.step + 1, 0);
    const perSecond = rows / Math.max(info.end - info.begin, 1);
    this.seconds = Math.max(SHORTEST_PART, ROWS_OF_PART / Math.max(perSecond, 1));
    void this.fetchPart(-1, info.begin, info.end, MOST_OVERVIEW);
  }

  /** All who are there at a time; null before anything has come. */
  at(time: number): { frame: Frame; crowd: Crowd } | null {
    const number = Math.floor((time - this.info.begin) / this.seconds);
    this.want(number);
    const part = this.parts.get(number) ?? this.overview;
    if (part === null) return null;
    // Beyond its last moment it is empty.
    return { frame: part.at(time), crowd: part.crowd };
  }

  private want(number: number): void {
    this.wanted = number;
    // Before the overview has come, it is what is waited for.
    if (this.parts.has(number) || this.fetching || this.overview === null) return;
    const begin = this.info.begin + number * this.seconds;
    void this.fetchPart(number, begin, begin + this.seconds, MOST_PART);
  }

  private async fetchPart(number: number, begin: number, end: number, most: number): Promise<void> {
    const { name, users, origin } = this.info;
    this.fetching = true;
    try {
      const data = await this.load(recordings.momentsUrl(name, begin, end, most));
      const part = new Replay(unpackMoments(data, users, origin));
      if (number < 0) this.overview = part;
      else this.parts.set(number, part);
      for (const old of this.parts.keys()) {
        if (this.parts.size <= KEPT) break;
        if (old !== number) this.parts.delete(old);
      }
      this.fetching = false;
      this.onPart();
      if (this.wanted >= 0) this.want(this.wanted);
    } catch (error) {
      this.fetching = false;
      this.onError(error);
    }
  }
}

async function fetched(url: string): Promise<ArrayBuffer> {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

/** How many road users are there in each of so many equal parts of the recording. */
export function density(users: Users, begin: number, end: number, parts: number): number[] {
  const found = new Array<number>(parts).fill(0);
  const width = Math.max(end - begin, 1e-9) / parts;
  for (const user of users) {
    const from = Math.max(0, Math.floor((user.begin - begin) / width));
    const to = Math.min(parts - 1, Math.floor((user.end - begin) / width));
    for (let part = from; part <= to; part++) found[part] = (found[part] ?? 0) + 1;
  }
  return found;
}

/** How many road users are there at one time, at most. */
export function mostAtOnce(users: Users): number {
  const begins = Float64Array.from(users, ({ begin }) => begin).sort();
  const ends = Float64Array.from(users, ({ end }) => end).sort();
  let [most, gone] = [0, 0];
  begins.forEach((begin, come) => {
    while ((ends[gone] ?? Infinity) < begin) gone += 1;
    most = Math.max(most, come + 1 - gone);
  });
  return most;
}
