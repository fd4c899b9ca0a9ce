import { t } from "@lingui/core/macro";
import { type KeyboardEvent, memo, type PointerEvent, useMemo, useRef } from "react";

import type { RecordedScene, RecordingInfo } from "../api/recordings";
import { useWidth } from "../time/useWidth";
import { density, mostAtOnce } from "./moments";
import { type Part, movedEnd, partBetween } from "./window";
import { KIND_COLOR, KIND_WORD, KINDS, recordedTime } from "./words";

const HEIGHT = 34;
/** Pixels from which on a press is a drag. */
const SLACK = 4;
/** Seconds that an arrow key moves, and with Shift. */
const STEP = 0.5;
const STRIDE = 5;

/** All of a recording: how many are on the road, its scenes, the moment, and the part that is chosen. */
export function TimeBar({
  info,
  scenes,
  time,
  part,
  onSeek,
  onPart,
}: {
  info: RecordingInfo;
  scenes: readonly RecordedScene[];
  time: number;
  part: Part;
  onSeek: (time: number) => void;
  onPart: (part: Part) => void;
}) {
  const [ref, width] = useWidth();
  const held = useRef<{ x: number; time: number; moved: boolean } | null>(null);
  const { begin, end, users } = info;
  const seconds = Math.max(end - begin, 1e-6);
  const share = (at: number): number => (100 * (at - begin)) / seconds;
  const curve = useMemo(() => {
    const counts = density(users, begin, end, Math.max(2, Math.min(400, Math.round(width / 3))));
    const most = Math.max(1, ...counts);
    const points = counts.map(
      (n, k) => `${(100 * (k + 0.5)) / counts.length},${HEIGHT - ((HEIGHT - 4) * n) / most}`,
    );
    return { most: mostAtOnce(users), path: `0,${HEIGHT} ${points.join(" ")} 100,${HEIGHT}` };
  }, [users, begin, end, width]);
  const timeAt = (event: PointerEvent): number => {
    const box = event.currentTarget.getBoundingClientRect();
    return begin + (seconds * (event.clientX - box.left)) / Math.max(box.width, 1);
  };
  const said = (at: number): string => recordedTime(info, at);
  const handle = (which: "begin" | "end", label: string) => (
    <div
      className="rec-handle"
      role="slider"
      tabIndex={0}
      aria-label={label}
      aria-valuemin={begin}
      aria-valuemax={end}
      aria-valuenow={part[which]}
      aria-valuetext={said(part[which])}
      style={{ left: `${share(part[which])}%` }}
      onKeyDown={(event: KeyboardEvent) => {
        const step = event.shiftKey ? STRIDE : STEP;
        const by: Record<string, number> = {
          ArrowRight: step,
          ArrowUp: step,
          ArrowLeft: -step,
          ArrowDown: -step,
          PageUp: STRIDE,
          PageDown: -STRIDE,
          Home: -seconds,
          End: seconds,
        };
        const change = by[event.key];
        if (change === undefined) return;
        event.preventDefault();
        onPart(movedEnd(part, which, part[which] + change, info));
      }}
      onPointerDown={(event) => {
        event.stopPropagation();
        event.currentTarget.setPointerCapture(event.pointerId);
      }}
      onPointerMove={(event) => {
        if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
        const box = event.currentTarget.parentElement?.getBoundingClientRect();
        if (box)
          onPart(movedEnd(part, which, begin + (seconds * (event.clientX - box.left)) / box.width, info));
      }}
    />
  );
  return (
    <div className="rec-bar">
      <div
        ref={ref}
        className="rec-track"
        data-testid="recording-bar"
        onPointerDown={(event) => {
          if (event.button !== 0) return;
          event.currentTarget.setPointerCapture(event.pointerId);
          held.current = { x: event.clientX, time: timeAt(event), moved: false };
        }}
        onPointerMove={(event) => {
          const from = held.current;
          if (!from) return;
          if (!from.moved && Math.abs(event.clientX - from.x) < SLACK) return;
          from.moved = true;
          onPart(partBetween(from.time, timeAt(event), info));
        }}
        onPointerUp={(event) => {
          const from = held.current;
          held.current = null;
          if (from && !from.moved) onSeek(timeAt(event));
        }}
        onPointerCancel={() => (held.current = null)}
      >
        <svg viewBox={`0 0 100 ${HEIGHT}`} preserveAspectRatio="none" aria-hidden="true">
          <polygon points={curve.path} />
        </svg>
        <div
          className="rec-part"
          aria-hidden="true"
          style={{ left: `${share(part.begin)}%`, width: `${share(part.end) - share(part.begin)}%` }}
        />
        <Marks info={info} scenes={scenes} />
        <b className="rec-now" aria-hidden="true" style={{ left: `${share(time)}%` }} />
        {handle("begin", t`Begin of the part`)}
        {handle("end", t`End of the part`)}
        <span className="rec-most" aria-hidden="true">
          {t`at most ${curve.most} at once`}
        </span>
      </div>
      <input
        type="range"
        aria-label={t`Moment of the recording`}
        min={begin}
        max={end}
        step={Math.max(info.step, seconds / 20_000)}
        value={time}
        aria-valuetext={t`${said(time)} of ${said(end)}`}
        onChange={(event) => onSeek(Number(event.currentTarget.value))}
      />
    </div>
  );
}

/** Marks of the scenes: as many as 10,000, which are not to be made anew with each moment. */
const Marks = memo(function Marks({
  info,
  scenes,
}: {
  info: RecordingInfo;
  scenes: readonly RecordedScene[];
}) {
  const seconds = Math.max(info.end - info.begin, 1e-6);
  return (
    <div className="rec-marks" aria-hidden="true">
      {scenes.map((scene, n) => (
        <i
          key={n}
          title={`${KIND_WORD()[scene.kind]}, ${recordedTime(info, scene.begin)}`}
          style={{
            left: `${(100 * (scene.begin - info.begin)) / seconds}%`,
            top: 2 + 6 * KINDS.indexOf(scene.kind),
            background: KIND_COLOR[scene.kind],
          }}
        />
      ))}
    </div>
  );
});
