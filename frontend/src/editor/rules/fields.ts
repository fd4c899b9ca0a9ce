import { t } from "@lingui/core/macro";

import { shownAs } from "../../language/units";
import { ApproachNames, NO_NAMES } from "../../map/placeNames";
import { short } from "../../language/numbers";
import { localized } from "../../language/localized";
import type { PickBy } from "../pick";

/** Fields of a condition or action, without those that are not given. */
export type Values = Readonly<Record<string, unknown>>;

interface Named {
  name: string;
  label: string;
}

/** A field of the form; `scale` is how many of its unit are one of the document's. */
export type PlainField =
  | (Named & {
      is: "number";
      suffix: string;
      min: number;
      max: number;
      digits: number;
      scale: number;
      /** What a new one begins with; without it the field may be empty. */
      start?: number;
      /** Whether it is a moment of the run. */
      moment?: boolean;
    })
  | (Named & { is: "actor"; optional?: boolean })
  /** A place, light or movement, picked on the map or typed. */
  | (Named & { is: "place"; by: PickBy; hint: string })
  | (Named & { is: "rule" })
  /** `otherwise` is what holds where none is given. */
  | (Named & {
      is: "choice";
      choices: Readonly<Record<string, string>>;
      optional?: boolean;
      otherwise?: string;
    })
  | (Named & { is: "flag"; otherwise: boolean })
  /** Places in their order; with `timed` also the speeds or times at them. */
  | (Named & { is: "points"; timed: boolean })
  | (Named & { is: "pose" })
  /** A recorded trajectory, which is only shown. */
  | (Named & { is: "rows" })
  | (Named & { is: "name" })
  /** Values of a kind of one's own, which are only shown. */
  | (Named & { is: "given" });

/** Exactly one of several fields, by their labels. */
export interface OneOf {
  is: "one";
  label: string;
  of: readonly PlainField[];
}

export type Field = (PlainField | OneOf) & {
  /** Whether it has no meaning with the other values; it is then left out. */
  without?: (values: Values) => boolean;
};

/** A kind of condition or action. */
export interface Kind {
  label: string;
  /** Who alone can do it. */
  only?: "vehicles" | "pedestrians";
  fields: readonly Field[];
  words: (values: Values, actor: string) => string;
}

type NumberField = Extract<PlainField, { is: "number" }>;

export const number = (
  name: string,
  label: string,
  suffix: string,
  start?: number,
  more: Partial<Pick<NumberField, "min" | "max" | "digits" | "scale" | "moment">> = {},
): NumberField => ({
  is: "number",
  name,
  label,
  suffix,
  min: 0,
  max: 1e4,
  digits: 1,
  scale: 1,
  start,
  ...more,
});

export const speed = (name: string, label: string, start?: number): NumberField =>
  number(name, label, " km/h", start, { max: 360, scale: 3.6 });

export const place = (name: string, label: string): PlainField => ({
  is: "place",
  name,
  label,
  by: "place",
  hint: t`a node, or x, y in metres`,
});

export const light = (): PlainField => ({
  is: "place",
  name: "light",
  label: t`Traffic light`,
  by: "light",
  hint: t`its junction`,
});

export const movement = (): PlainField => ({
  is: "place",
  name: "movement",
  label: t`Movement`,
  by: "turn",
  hint: t`r1>r2, or walk r1`,
});

export const OF = localized((): Field => ({
  is: "actor",
  name: "of",
  label: t`Measured for (default: this actor)`,
  optional: true,
}));
export const TO = localized((): Field => ({ is: "actor", name: "to", label: t`Other road user` }));

/** How a vehicle moves to the side: for how long, or how far or fast, and on which line. */
export const SIDEWAYS = localized((): readonly Field[] => [
  {
    is: "one",
    label: t`How`,
    of: [
      number("over", t`In a time`, " s", 3, { min: 0.1 }),
      number("within", t`In a distance`, " m", 40, { min: 0.1 }),
      number("rate", t`At a lateral speed`, " m/s", 1, { min: 0.1, max: 100 }),
    ],
  },
  {
    is: "choice",
    name: "shape",
    label: t`Line`,
    choices: { cosine: t`Half-cosine`, cubic: t`Cubic`, linear: t`Linear` },
    otherwise: "cosine",
  },
]);
/** " over 3 s", as {@link SIDEWAYS} has it. */
export const sidewaysWords = (values: Values): string =>
  given(values.within)
    ? t` within ${amount(values.within, "m")}`
    : given(values.rate)
      ? t` at ${amount(values.rate, "m/s")}`
      : t` over ${amount(values.over ?? 3, "s")}`;

/** Of a kind that an installed package gives. */
export const OWN = localized((): readonly Field[] => [
  { is: "name", name: "kind", label: t`Its name` },
  { is: "given", name: "values", label: t`Values` },
  { is: "actor", name: "to", label: t`Other road user (may be empty)`, optional: true },
]);

/** Values by name, as in "gap 3, side left". */
export const listed = (values: unknown): string =>
  Object.entries(given(values) ? (values as object) : {})
    .map(([name, value]) => `${name} ${String(value)}`)
    .join(", ");

/** Below or above a value. */
export const bound = (suffix: string, start: number, scale = 1, min = 0): Field => ({
  is: "one",
  label: t`Bound`,
  of: [
    number("below", t`Below`, suffix, start, { digits: 2, scale, min, max: 1e6 }),
    number("above", t`Above`, suffix, start, { digits: 2, scale, min, max: 1e6 }),
  ],
});

// Words

export const given = (value: unknown): boolean => value !== undefined && value !== null;

let placeName = (node: string): string => node;
let mapNames = NO_NAMES;
/** Say in sentences where nodes and lights are; before a map is there they are called by their ids. */
export const namePlaces = (by: (node: string) => string, names = NO_NAMES): void => {
  placeName = by;
  mapNames = names;
};

/** The junction of a traffic light in words. */
export const lightText = (light: unknown): string =>
  typeof light === "string" && light ? mapNames.junction(light) : "…";

/** A movement at a traffic light: `from the west, left turn`. */
export const movementText = (light: unknown, movement: unknown): string =>
  typeof light === "string" && typeof movement === "string" && movement
    ? new ApproachNames(mapNames, { junctions: [light], lanes: [] }).movement(movement)
    : "…";

const metres = (value: unknown): string => (typeof value === "number" ? short(value, 1) : "?");

/** The name of a road user, or a place in words. */
export const text = (value: unknown): string => {
  if (Array.isArray(value)) return t`x ${metres(value[0])} m, y ${metres(value[1])} m`;
  return typeof value === "string" && value ? placeName(value) : "…";
};

export function amount(value: unknown, unit: string, scale = 1): string {
  const shown = shownAs(` ${unit}`);
  return typeof value === "number"
    ? `${short(value * scale * shown.scale, 2)}${shown.suffix}`
    : `…${shown.suffix}`;
}

/** Words with an amount if there is one. */
export const maybe = (value: unknown, words: string, unit: string, scale = 1): string =>
  given(value) ? `${words} ${amount(value, unit, scale)}` : "";

export const limit = (values: Values, unit: string, scale = 1): string =>
  given(values.above)
    ? t`above ${amount(values.above, unit, scale)}`
    : t`below ${amount(values.below, unit, scale)}`;

export const whose = (values: Values, actor: string): string => (given(values.of) ? text(values.of) : actor);

export const between = (values: Values): string =>
  given(values.of) ? t`of ${text(values.of)} to ${text(values.to)}` : t`to ${text(values.to)}`;
