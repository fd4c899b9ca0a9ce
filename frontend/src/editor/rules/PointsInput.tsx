import { Group, Select } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { inSentence } from "../../ui/words";
import { localized } from "../../language/localized";
import { nth } from "../../lists";
import { Committed } from "../Committed";
import { CommittedText, ListButtons, PickButton } from "../FormParts";
import type { PlacePick } from "../pick";
import { placeText, readPlace } from "./draft";
import type { FieldProps } from "./FieldInput";
import type { PlainField, Values } from "./fields";

type Timed = "none" | "speed" | "speeds" | "times";
const TIMED = localized((): Record<Timed, string> => ({
  none: t`Its own speed`,
  speed: t`One speed`,
  speeds: t`A speed at each point`,
  times: t`A time at each point`,
}));
/** What a new path is driven with, m/s, and the seconds between its points. */
const SPEED = 5;
const APART = 2;

const listOf = (value: unknown): readonly unknown[] => (Array.isArray(value) ? value : []);
const numbersOf = (value: unknown): number[] =>
  listOf(value).filter((one): one is number => typeof one === "number");

function timedOf({ speed, speeds, times }: Values): Timed {
  if (typeof speed === "number") return "speed";
  if (listOf(speeds).length > 0) return "speeds";
  return listOf(times).length > 0 ? "times" : "none";
}

/** The values with other points: each has its own speed or time where the path has such. */
function withPoints(values: Values, name: string, points: readonly unknown[], numbers: number[]): Values {
  const timed = timedOf(values);
  const each = timed === "speeds" || timed === "times";
  return { ...values, [name]: points, ...(each && { [timed]: numbers }) };
}

/** Places in their order: clicked on the map one after another, or typed. */
export function PointsInput({
  field: { name, label, timed },
  values,
  where,
  pick,
  onChange,
}: FieldProps & { field: Extract<PlainField, { is: "points" }> }) {
  const points = listOf(values[name]);
  const kind = timed ? timedOf(values) : "none";
  const each = kind === "speeds" || kind === "times";
  const numbers = each ? numbersOf(values[kind]) : [];
  const add = (place: unknown): void => {
    const last = numbers.at(-1);
    const next = kind === "times" ? (last ?? 0) + APART : (last ?? SPEED);
    onChange(withPoints(values, name, [...points, place], [...numbers, next]));
  };
  const put = (n: number, place: unknown): void =>
    onChange({ ...values, [name]: points.map((one, k) => (k === n ? place : one)) });
  const remove = (n: number): void => {
    const left = <T,>(all: readonly T[]): T[] => all.filter((_, k) => k !== n);
    onChange(withPoints(values, name, left(points), left(numbers)));
  };
  const swap = (n: number): void => {
    const next = [...points];
    [next[n - 1], next[n]] = [nth(points, n), nth(points, n - 1)];
    onChange({ ...values, [name]: next });
  };
  return (
    <section className="points" aria-label={label}>
      {points.map((point, n) => (
        <Group key={n} gap={6} align="flex-end" wrap="nowrap" mb={6}>
          <div style={{ flex: 2 }}>
            <CommittedText
              label={`${label} ${n + 1}`}
              value={placeText(point)}
              onCommit={(typed) => {
                if (typed) put(n, readPlace(typed));
              }}
            />
          </div>
          {each && (
            <div style={{ flex: 1 }}>
              <AtPoint
                kind={kind}
                value={numbers[n]}
                point={n + 1}
                onChange={(value) =>
                  onChange({ ...values, [kind]: numbers.map((one, k) => (k === n ? value : one)) })
                }
              />
            </div>
          )}
          <ListButtons
            earlier={t`Move ${inSentence(label)} ${n + 1} earlier`}
            removal={t`Remove ${inSentence(label)} ${n + 1}`}
            first={n === 0}
            only={false}
            onEarlier={() => swap(n)}
            onRemove={() => remove(n)}
          />
        </Group>
      ))}
      <CommittedText
        key={points.length}
        label={t`${label}: one more`}
        placeholder={t`a node, or x, y in metres`}
        value=""
        onCommit={(typed) => add(readPlace(typed))}
      />
      <PickButton
        pick={pick}
        pickKey={`rule ${where} ${name}`}
        by="ground"
        many
        onTake={({ x, y }) => add([x, y])}
      >
        {t`${label} on the map`}
      </PickButton>
      {timed && <PathSpeed values={values} points={points.length} onChange={onChange} />}
    </section>
  );
}

/** How fast a path is followed: not said, at one speed, or by speeds or times at its points. */
function PathSpeed({
  values,
  points,
  onChange,
}: {
  values: Values;
  points: number;
  onChange: (values: Values) => void;
}) {
  const kind = timedOf(values);
  const choose = (next: Timed): void => {
    const rest = Object.fromEntries(
      Object.entries(values).filter(([name]) => !["speed", "speeds", "times"].includes(name)),
    );
    const made: Values =
      next === "speed"
        ? { speed: SPEED }
        : next === "speeds"
          ? { speeds: Array.from({ length: points }, () => SPEED) }
          : next === "times"
            ? { times: Array.from({ length: points }, (_, k) => APART * (k + 1)) }
            : {};
    onChange({ ...rest, ...made });
  };
  // A speed or time at each of no points would be lost: an empty list says none.
  const choices = Object.entries(TIMED()).filter(
    ([value]) => points > 0 || value === "none" || value === "speed",
  );
  return (
    <>
      <Select
        label={t`How fast`}
        data={choices.map(([value, label]) => ({ value, label }))}
        value={kind}
        allowDeselect={false}
        onChange={(next) => {
          if (next !== null && next in TIMED()) choose(next as Timed);
        }}
      />
      {kind === "speed" && (
        <Committed
          label={t`Speed`}
          suffix={" km/h"}
          min={0.1}
          max={360}
          digits={1}
          value={Number(values.speed) * 3.6}
          onCommit={(value) => {
            if (value !== null) onChange({ ...values, speed: value / 3.6 });
          }}
        />
      )}
    </>
  );
}

function AtPoint({
  kind,
  value,
  point,
  onChange,
}: {
  kind: "speeds" | "times";
  value: number | undefined;
  point: number;
  onChange: (value: number) => void;
}) {
  const scale = kind === "speeds" ? 3.6 : 1;
  return (
    <Committed
      label={kind === "speeds" ? t`Speed ${point}` : t`Time ${point}`}
      suffix={kind === "speeds" ? " km/h" : " s"}
      min={kind === "speeds" ? 0 : 0.1}
      max={kind === "speeds" ? 360 : 1e6}
      digits={1}
      value={value === undefined ? "" : value * scale}
      onCommit={(next) => {
        if (next !== null) onChange(next / scale);
      }}
    />
  );
}

const DEGREES = 180 / Math.PI;

/** An exact pose, or none; on the map that of a node. */
export function PoseInput({
  label,
  value,
  where,
  pick,
  onChange,
}: {
  label: string;
  value: unknown;
  where: string;
  pick: PlacePick;
  onChange: (pose: readonly number[] | null) => void;
}) {
  const pose = numbersOf(value);
  const [x = 0, y = 0, heading = 0] = pose;
  return (
    <>
      <CommittedText
        label={label}
        placeholder={t`where it is placed; or x, y in metres`}
        value={pose.length === 3 ? `${x}, ${y}` : ""}
        onCommit={(typed) => {
          const place = readPlace(typed);
          if (!typed) onChange(null);
          else if (Array.isArray(place)) onChange([...place, heading]);
        }}
      />
      {pose.length === 3 && (
        <Committed
          label={t`Heading (from east, counter-clockwise)`}
          suffix="°"
          min={-360}
          max={360}
          digits={1}
          value={heading * DEGREES}
          onCommit={(next) => onChange([x, y, (next ?? 0) / DEGREES])}
        />
      )}
      <PickButton
        pick={pick}
        pickKey={`rule ${where} at`}
        by="place"
        onTake={(picked) => onChange([picked.x, picked.y, picked.hdg])}
      >
        {t`${label} on the map`}
      </PickButton>
    </>
  );
}
