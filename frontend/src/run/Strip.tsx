import { Button, Group, Progress, Select, Text } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { fixed } from "../language/numbers";
import { type Action, type Incident, type RunInfo, runs, type RunState } from "../api/runs";
import { MARK_COLOR } from "../map/colors";
import { IconBack, IconPause, IconPlay, IconStep, IconStop } from "../ui/icons";
import { tellError } from "../ui/notices";
import { longClock } from "../language/moments";
import { hoursMinutes } from "../ui/words";
import { REPLAY_SPEEDS, type Speed, SPEEDS, STATE_WORD } from "./figures";
import { markKind } from "./incidents";
import type { Now } from "./usePicture";
import type { Player } from "./useReplay";

const STEP = 0.5;
/** Simulated seconds from which on the remaining time is shown. */
const LONG = 3600;

/** Controls a run, and shows its progress. */
export function LiveStrip({
  info,
  now,
  onBack,
  learn,
}: {
  info: RunInfo;
  now: Now;
  onBack: () => void;
  learn: (state: RunState, speed?: number | null) => void;
}) {
  const { run, state } = info;
  const control = (action: Action, speed?: number | null): void => {
    runs.control(run, action, speed).then((answer) => learn(answer.state, answer.speed), tellError);
  };
  const going = state === "running" || state === "paused";
  const until = info.progress?.until ?? 0;
  // Only where it matters; at a chosen speed it takes as long as one has chosen.
  const left = until > LONG && info.speed == null ? info.progress?.time_left : null;
  return (
    <div className="strip" role="region" aria-label={t`The run`}>
      <Back onBack={onBack} />
      <Group gap={6} role="group" aria-label={t`Control the run`}>
        {state === "paused" ? (
          <Button leftSection={<IconPlay />} onClick={() => control("resume")}>
            <Trans>Resume</Trans>
          </Button>
        ) : (
          <Button leftSection={<IconPause />} disabled={state !== "running"} onClick={() => control("pause")}>
            <Trans>Pause</Trans>
          </Button>
        )}
        {!info.slices && (
          <Button
            variant="default"
            leftSection={<IconStep />}
            disabled={state !== "paused"}
            onClick={() => control("step")}
          >
            <Trans>One step</Trans>
          </Button>
        )}
        <Button
          variant="default"
          leftSection={<IconStop />}
          disabled={!going && state !== "preparing"}
          onClick={() => control("stop")}
        >
          <Trans>Stop</Trans>
        </Button>
        {info.slices && (
          <Button variant="default" disabled={!going} onClick={() => control("interrupt")}>
            <Trans>Pause and save</Trans>
          </Button>
        )}
        <SpeedChoice
          speeds={SPEEDS()}
          speed={info.speed ?? null}
          onChange={(speed) => control("speed", speed)}
        />
      </Group>
      <div className="time-line">
        <Progress
          value={until ? Math.min(100, (100 * now.time) / until) : 0}
          aria-label={t`Progress of the run`}
        />
        <Text size="sm" mt={4}>
          {STATE_WORD()[state]}
          {left != null && state === "running" && t`, about ${hoursMinutes(left + 30)} left`}
        </Text>
      </div>
      <Shown label={t`Time`} value={longClock(now.time, until)} />
      <Shown label={t`Real-time factor`} value={fixed(now.pace, 1)} />
      <Shown label={t`On the road`} value={String(now.running)} />
      <Shown label={t`Arrived`} value={String(now.arrived)} />
    </div>
  );
}

/** Plays a recording: a slider over its time, with incidents marked above it. */
export function ReplayStrip({
  player,
  recorded,
  running,
  incidents,
  onBack,
  onPlay,
}: {
  player: Player;
  /** Whether the run left a recording. */
  recorded: boolean;
  running: number;
  incidents: readonly Incident[];
  onBack: () => void;
  /** Also the first time, when there is nothing to play yet. */
  onPlay: () => void;
}) {
  const { replay, time, playing } = player;
  const [begin, end] = replay ? [replay.begin, replay.end] : [0, 0];
  return (
    <div className="strip" role="region" aria-label={t`The recording`}>
      <Back onBack={onBack} />
      <Group gap={6} role="group" aria-label={t`Control the recording`}>
        {playing && replay ? (
          <Button leftSection={<IconPause />} onClick={player.pause}>
            <Trans>Pause</Trans>
          </Button>
        ) : (
          <Button
            leftSection={<IconPlay />}
            onClick={onPlay}
            loading={player.loading}
            disabled={!recorded || player.error !== null}
          >
            {replay ? t`Play` : t`Watch again`}
          </Button>
        )}
        <SpeedChoice
          speeds={REPLAY_SPEEDS()}
          speed={player.speed}
          onChange={(speed) => player.setSpeed(speed ?? 1)}
        />
      </Group>
      {replay ? (
        <div className="scrub">
          <div className="scrub-marks" aria-hidden="true">
            {end > begin &&
              incidents.slice(0, 200).map((one, n) => (
                <i
                  key={n}
                  style={{
                    left: `${(100 * (one.time - begin)) / (end - begin)}%`,
                    background: MARK_COLOR[markKind(one)],
                  }}
                />
              ))}
          </div>
          <input
            type="range"
            aria-label={t`Moment of the run`}
            min={begin}
            max={end}
            step={Math.min(STEP, (end - begin) / 2 || STEP)}
            value={time}
            aria-valuetext={t`${longClock(time, end)} of ${longClock(end, end)}`}
            onChange={(event) => {
              player.pause();
              player.seek(Number(event.currentTarget.value));
            }}
          />
        </div>
      ) : (
        <Text size="sm" className="time-line" c="dimmed">
          {!recorded || player.error
            ? t`There is no recording of this run.`
            : player.loading
              ? t`Fetching the recording …`
              : t`The run is over.`}
        </Text>
      )}
      {replay && <Shown label={t`of ${longClock(end, end)}`} value={longClock(time, end)} />}
      {replay && <Shown label={t`On the road`} value={String(running)} />}
    </div>
  );
}

function Back({ onBack }: { onBack: () => void }) {
  return (
    <Button variant="default" leftSection={<IconBack />} onClick={onBack}>
      <Trans>Back to the editor</Trans>
    </Button>
  );
}

function SpeedChoice({
  speeds,
  speed,
  onChange,
}: {
  speeds: Speed[];
  speed: number | null;
  onChange: (speed: number | null) => void;
}) {
  const known = speeds.find((one) => one.speed === speed);
  return (
    <Select
      aria-label={t`Speed`}
      w={150}
      data={speeds.map(({ value, label }) => ({ value, label }))}
      allowDeselect={false}
      value={known?.value ?? null}
      placeholder={speed === null ? undefined : `${speed} ×`}
      onChange={(value) => {
        const found = speeds.find((one) => one.value === value);
        if (found) onChange(found.speed);
      }}
    />
  );
}

function Shown({ label, value }: { label: string; value: string }) {
  return (
    <div className="figure">
      <b>{value}</b>
      <span>{label}</span>
    </div>
  );
}
