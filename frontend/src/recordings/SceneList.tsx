import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { Chip, Group, Text } from "@mantine/core";
import { memo } from "react";

import type { RecordedScene, RecordingInfo, SceneKind } from "../api/recordings";
import { fixed } from "../language/numbers";
import { KIND_COLOR, KIND_WORD, KINDS, recordedTime, valueText, whoText } from "./words";

/** So many are listed; the bar has all. */
const MOST = 300;

/** Scenes that were found, by kind and time; one that is chosen becomes the part and its ego. */
export const SceneList = memo(function SceneList({
  info,
  kinds,
  onKinds,
  scenes,
  chosen,
  onChoose,
}: {
  info: RecordingInfo;
  kinds: readonly SceneKind[];
  onKinds: (kinds: SceneKind[]) => void;
  /** Those of the kinds that are shown. */
  scenes: readonly RecordedScene[];
  chosen: RecordedScene | null;
  onChoose: (scene: RecordedScene) => void;
}) {
  const there = KINDS.flatMap((kind) => info.frequencies.filter((one) => one.kind === kind));
  if (!info.searched) return null;
  if (there.length === 0)
    return (
      <Text size="sm" c="dimmed">
        <Trans>
          No cut-in, hard braking, short time to collision, crossing pedestrian or lane change was found.
        </Trans>
      </Text>
    );
  return (
    <>
      <Chip.Group multiple value={[...kinds]} onChange={(next) => onKinds(next as SceneKind[])}>
        <Group gap={6} role="group" aria-label={t`Kinds of scenes`}>
          {there.map(({ kind, count, per_hour }) => (
            <Chip
              key={kind}
              value={kind}
              size="xs"
              variant="outline"
              title={per_hour === null ? undefined : t`${fixed(per_hour, 0)} an hour`}
            >
              <i className="rec-dot" style={{ background: KIND_COLOR[kind] }} aria-hidden="true" />{" "}
              {KIND_WORD()[kind]} ({count})
            </Chip>
          ))}
        </Group>
      </Chip.Group>
      <ul className="rows rec-scenes" aria-label={t`Scenes`}>
        {scenes.slice(0, MOST).map((scene, n) => (
          <li key={n}>
            <button type="button" aria-pressed={scene === chosen} onClick={() => onChoose(scene)}>
              <i className="rec-dot" style={{ background: KIND_COLOR[scene.kind] }} aria-hidden="true" />
              <time>{recordedTime(info, scene.begin)}</time>
              <span>
                {KIND_WORD()[scene.kind]}: {whoText(scene)}
              </span>
              <span className="far">{valueText(scene)}</span>
            </button>
          </li>
        ))}
      </ul>
      {scenes.length > MOST && (
        <Text size="xs" c="dimmed">
          <Trans>The first {MOST} are listed; the bar shows all.</Trans>
        </Text>
      )}
    </>
  );
});
