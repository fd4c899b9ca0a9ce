import { Button, Collapse, SegmentedControl, Slider, Switch, Text } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { localized } from "../language/localized";
import type { Assets, Edit, ScenarioDocument, WeatherPreset } from "../api/types";
import { kindWord, PARAMETERS, weatherWord } from "../ui/words";

const TIMES = localized(() => [
  { value: "day", label: t`Day` },
  { value: "sunset", label: t`Sunset` },
  { value: "night", label: t`Night` },
]);
const KINDS = ["clear", "cloudy", "wet", "rain_light", "rain_medium", "rain_heavy", "fog", "dust"];

/** One preset for each kind of weather at one time of day. */
export function presetsAt(weather: readonly WeatherPreset[], time: string): WeatherPreset[] {
  return KINDS.flatMap((kind) => weather.find((one) => one.kind === kind && one.time_of_day === time) ?? []);
}

interface Props {
  assets: Assets;
  document: ScenarioDocument;
  onEdit: (edit: Edit) => void;
}

export function EnvironmentStep({ assets, document, onEdit }: Props) {
  const { environment } = document;
  const chosen = assets.weather.find((one) => one.name === environment.preset);
  const [time, setTime] = useState<string>(chosen?.time_of_day ?? "day");
  const [fine, setFine] = useState(false);
  const values = { ...chosen?.parameters, ...environment.parameters };

  const changeTime = (next: string): void => {
    setTime(next);
    const same = presetsAt(assets.weather, next).find((one) => one.kind === chosen?.kind);
    if (same) onEdit({ kind: "set_environment", preset: same.name });
  };
  return (
    <>
      <SegmentedControl
        fullWidth
        data={TIMES()}
        value={time}
        onChange={changeTime}
        aria-label={t`Time of day`}
      />
      <div className="weather" role="radiogroup" aria-label={t`Weather`}>
        {presetsAt(assets.weather, time).map((preset) => (
          <button
            type="button"
            role="radio"
            key={preset.name}
            aria-checked={preset.kind === chosen?.kind && preset.time_of_day === chosen.time_of_day}
            onClick={() => onEdit({ kind: "set_environment", preset: preset.name })}
          >
            <WeatherPicture kind={preset.kind} time={preset.time_of_day} />
            {kindWord(preset.kind)}
          </button>
        ))}
      </div>
      {chosen && (
        <Text size="sm">
          <Trans>
            Now: <b>{weatherWord(chosen)}</b>
            {Object.keys(environment.parameters).length > 0 ? t`, fine-tuned` : ""}
          </Trans>
        </Text>
      )}
      <Switch
        label={t`Weather affects driver behaviour`}
        checked={environment.affects_driving}
        onChange={(event) =>
          onEdit({ kind: "set_environment", affects_driving: event.currentTarget.checked })
        }
      />
      <Button
        variant="subtle"
        size="compact-sm"
        justify="flex-start"
        aria-expanded={fine}
        onClick={() => setFine(!fine)}
      >
        {fine ? t`Hide fine-tuning` : t`Fine-tune`}
      </Button>
      <Collapse in={fine}>
        {PARAMETERS().map(({ name, word }) => {
          const value = values[name];
          return (
            value !== undefined && (
              <Parameter
                key={`${name} ${value}`}
                word={word}
                name={name}
                value={value}
                onChange={(next) =>
                  onEdit({ kind: "set_environment", parameters: { ...environment.parameters, [name]: next } })
                }
              />
            )
          );
        })}
      </Collapse>
    </>
  );
}

function Parameter({
  word,
  name,
  value,
  onChange,
}: {
  word: string;
  name: string;
  value: number;
  onChange: (value: number) => void;
}) {
  const [now, setNow] = useState(value);
  const [low, high, unit] =
    name === "sun_altitude_angle"
      ? [-90, 90, "°"]
      : name === "sun_azimuth_angle"
        ? [-180, 360, "°"]
        : name === "fog_distance"
          ? [0, 500, " m"]
          : [0, 100, " %"];
  return (
    <div style={{ marginBottom: 8 }}>
      <Text size="sm">
        {word}: {Math.round(now)}
        {unit}
      </Text>
      <Slider
        min={low}
        max={high}
        step={1}
        label={null}
        value={now}
        onChange={setNow}
        onChangeEnd={onChange}
        thumbLabel={word}
      />
    </div>
  );
}

const SKY = {
  day: ["#8ec9f5", "#dff1fd"],
  sunset: ["#5b5a9c", "#f5a462"],
  night: ["#0b1630", "#27375f"],
} as const;

/** A small picture of sky and road. */
export function WeatherPicture({ kind, time }: { kind: string; time: WeatherPreset["time_of_day"] }) {
  const id = `sky-${kind}-${time}`;
  const rain = { rain_light: 5, rain_medium: 10, rain_heavy: 18 }[kind] ?? 0;
  const grey = kind.startsWith("rain") || kind === "cloudy";
  const wet = kind === "wet" || rain > 0;
  return (
    <svg viewBox="0 0 72 48" aria-hidden="true">
      <defs>
        <linearGradient id={id} x2="0" y2="1">
          <stop stopColor={SKY[time][0]} />
          <stop offset="1" stopColor={SKY[time][1]} />
        </linearGradient>
      </defs>
      <rect width="72" height="48" fill={`url(#${id})`} />
      {time === "night" ? (
        <path d="M54 8a7 7 0 1 0 6 11 6 6 0 0 1-6-11z" fill="#f4eec5" />
      ) : (
        <circle cx="55" cy={time === "day" ? 13 : 28} r="7" fill={time === "day" ? "#ffd64a" : "#ffe3a0"} />
      )}
      {grey && (
        <path
          d="M10 21a7 7 0 0 1 8-8 10 10 0 0 1 18-2 9 9 0 0 1 14 7 6 6 0 0 1 2 11H16a6 6 0 0 1-6-8z"
          fill={time === "night" ? "#4c5873" : "#c3ccd6"}
        />
      )}
      <path d="M0 34h72v14H0z" fill={time === "night" ? "#1d2a1f" : "#8fae7b"} />
      <path d="M31 34h10l15 14H16z" fill={wet ? "#4b5663" : "#707983"} />
      {wet && <path d="M33 38h6l5 10H28z" fill="#a9cfee" opacity=".45" />}
      <path d="M35.500 36h1l.7 4h-2.400zM34.500 43h3l.8 5h-4.600z" fill="#fff" />
      {Array.from({ length: rain }, (_, i) => (
        <path
          key={i}
          d={`M${(i * 29) % 70} ${14 + ((i * 17) % 28)}l-2 6`}
          stroke="#e7f3ff"
          strokeWidth="1.300"
        />
      ))}
      {kind === "fog" && (
        <>
          <rect width="72" height="48" fill="#e9edf0" opacity=".55" />
          <path
            d="M4 20h50M14 27h54M2 34h46M20 41h50"
            stroke="#fff"
            strokeWidth="3.500"
            strokeLinecap="round"
            opacity=".85"
          />
        </>
      )}
      {kind === "dust" && (
        <>
          <rect width="72" height="48" fill="#c08a4a" opacity=".6" />
          <path
            d="M4 18q10-5 20 0t20 0 20 0M2 30q10-5 20 0t20 0 24 0"
            stroke="#f0cf9a"
            strokeWidth="2.500"
            fill="none"
            opacity=".9"
          />
        </>
      )}
    </svg>
  );
}
