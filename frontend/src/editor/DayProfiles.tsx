import { Select } from "@mantine/core";

import { t } from "@lingui/core/macro";
import { localized } from "../language/localized";
import type { Demand } from "../api/demand";
import { peakWords } from "./demand";

export type Profiles = Readonly<Record<string, readonly number[]>>;

const W = 288;
const H = 44;
const WORD = localized((): Record<string, string> => ({ weekday: t`Weekday`, weekend: t`Weekend` }));
export const profileWord = (id: string): string => WORD()[id] ?? id;

/** All day profiles that a scenario can use: the built-in ones and its own. */
export const profilesOf = (demand: Demand, builtIn: Profiles): Profiles => ({
  ...builtIn,
  ...Object.fromEntries(demand.profiles.map((profile) => [profile.id, sharesOfDay(profile)])),
});

const DAY_MINUTES = 1440;
const gcd = (a: number, b: number): number => (b === 0 ? a : gcd(b, a % b));

/** Shares of equal slices of the whole day; a profile between two times has nothing beside them. */
export function sharesOfDay({ shares, begin, end }: Demand["profiles"][number]): readonly number[] {
  if (begin == null || end == null) return shares;
  const first = Math.round(begin / 60);
  const slice = Math.round((end - begin) / 60 / shares.length);
  const step = gcd(gcd(first, slice), DAY_MINUTES);
  return Array.from(
    { length: DAY_MINUTES / step },
    (_, n) => shares[Math.floor((n * step - first) / slice)] ?? 0,
  );
}

/** How traffic varies over the day, with a picture of it. */
export function ProfileChoice({
  value,
  profiles,
  onChange,
}: {
  value: string | null;
  profiles: Profiles;
  onChange: (profile: string | null) => void;
}) {
  const data = [
    { value: "", label: t`Uniform` },
    ...Object.keys(profiles).map((id) => ({ value: id, label: profileWord(id) })),
  ];
  return (
    <div>
      <Select
        label={t`Day profile`}
        data={data}
        value={value ?? ""}
        allowDeselect={false}
        onChange={(chosen) => onChange(chosen || null)}
      />
      {value !== null && profiles[value] && (
        <ProfileChart name={profileWord(value)} shares={profiles[value]} />
      )}
    </div>
  );
}

/** A bar for each slice of the day. */
export function ProfileChart({ name, shares }: { name: string; shares: readonly number[] }) {
  const most = Math.max(...shares);
  const width = W / shares.length;
  return (
    <svg
      className="profile"
      viewBox={`0 0 ${W} ${H + 14}`}
      role="img"
      aria-label={t`${name} over the day: ${peakWords(shares)}`}
    >
      {shares.map((share, n) => (
        <rect
          key={n}
          x={n * width + Math.min(0.6, width / 8)}
          width={Math.max(0.3, width - Math.min(1.2, width / 4))}
          y={H - (H * share) / most}
          height={(H * share) / most}
        />
      ))}
      <line x1={0} x2={W} y1={H + 0.5} y2={H + 0.5} />
      {[0, 6, 12, 18, 24].map((hour) => (
        <text
          key={hour}
          x={(W * hour) / 24}
          y={H + 12}
          textAnchor={hour === 0 ? "start" : hour === 24 ? "end" : "middle"}
        >
          {hour}:00
        </text>
      ))}
    </svg>
  );
}
