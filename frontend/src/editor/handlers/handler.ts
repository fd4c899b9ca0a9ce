import type { Actor, Category, Flow } from "../../api/types";
import type { Area } from "../../map/areas";
import type { Graph, Place } from "../../map/graph";
import type { Pointed } from "../../map/MapCanvas";
import type { Picker } from "../../map/picking";
import type { SceneActor, SceneFlow } from "../../map/scene";
import type { LightProgram } from "../../api/signals";
import type { Timing } from "../../signals/editing";
import type { Heads } from "../../signals/heads";
import type { LoopPlace } from "../../signals/laneLines";
import type { Region } from "../asked";
import type { Changes } from "../changes";
import type { PlacePick } from "../pick";
import type { BodySize, Starts } from "../placing";
import type { Step } from "../scene";

/** Stations of a route, at least two, one of which is being chosen: the route is shown before the click. */
export type Trial = readonly string[];

/** What lies under the pointer, as far as the handler in charge cares. */
export type Hover =
  | { is: "place"; place: Place; trial?: Trial | undefined }
  | { is: "segment"; row: number }
  | { is: "route"; id: string }
  | { is: "light"; junction: string }
  | ({ is: "loop" } & LoopPlace);

/** What the pointer does on the map now: one for each step of the editor and for each tool. */
export interface Handler {
  /** Whether a click chooses something, so that the pointer is a cross. */
  readonly aim: boolean;
  /** Whether points for pedestrians or for vehicles matter; null is both. */
  readonly walks: boolean | null;
  /** The kind that is shown at the pointer. */
  readonly badge: Category | null;
  under(at: Pointed): Hover | null;
  /** What to do next, or what lies under the pointer. */
  hint(hover: Hover | null): string | null;
  pick(at: Pointed): void;
  /** Takes what is here along until it is dropped; null if the drag moves the map. */
  grab(at: Pointed): Carrier | null;
  /** A rectangle was drawn, or a line around something. */
  frame(area: Area): void;
}

/** Takes something along while the button is held down. */
export interface Carrier {
  under(at: Pointed): Hover | null;
  /** What is taken along, and how it is put down. */
  readonly hint: string;
  drop(at: Pointed): void;
  /** Whether it is only put down where a route leads. */
  readonly needsRoute?: boolean;
}

/** A handler that takes points of the region, on the map or without it. */
export interface ToolHandler extends Handler {
  /** Takes the next point there is, for those who do not point. */
  somewhere(): void;
}

/** Something to be taken into the hand; its handler says what it does on the map. */
export interface Tool {
  /** The same for two tools that do the same. */
  readonly key: string;
  /** What is said beside the map. */
  readonly help: string;
  /** The button for those who do not point. */
  readonly elsewhere: string;
  /** Whether the goals that the selected one can have are shown meanwhile. */
  readonly goals: boolean;
  /** Whether it makes something new, so that nothing stays selected when it is taken. */
  readonly makes: boolean;
  handler(editing: Editing): ToolHandler;
}

/** What handlers know of the editor, and what they may ask of it. */
export interface Editing {
  graph: Graph;
  picker: Picker;
  roi: readonly string[];
  region: Region;
  /** Every road user and flow, and those of them that are drawn. */
  ones: readonly (Actor | Flow)[];
  actors: readonly SceneActor[];
  flows: readonly SceneFlow[];
  starts: Starts;
  /** Length and width that are usual for a kind of road user, metres. */
  sizeOf: (category: Category) => BodySize;
  selection: readonly string[];
  /** The only one that is selected, and where it can go; null until that is known. */
  one: Actor | Flow | null;
  goals: readonly Place[] | null;
  /** Points of its route, from each station to the next. */
  legs: readonly (readonly (readonly [number, number])[])[];
  /** Where the map has traffic lights, once that is known. */
  lights: Heads | null;
  /** The junction whose traffic light is shown, its program once it is there, and its detectors of the scenario. */
  light: string | null;
  program: LightProgram | null;
  detectors: readonly Timing["detectors"][number][];
  /** Shows the program of the light of a junction. */
  showLight: (junction: string) => void;
  changes: Changes;
  /** Places that are picked for a form. */
  pick: PlacePick;
  select: (ids: readonly string[]) => void;
  openStep: (step: Step) => void;
  /** Opens the step of the road users; the map stays where it is. */
  openActors: () => void;
  /** Puts the tool back. */
  done: () => void;
  say: (text: string) => void;
}

/** A handler to which the map is only to be looked at; others differ from it where they do something. */
export const LOOKING: Handler = {
  aim: false,
  walks: null,
  badge: null,
  under: () => null,
  hint: () => null,
  pick: () => undefined,
  grab: () => null,
  frame: () => undefined,
};

/** Whether the one with this id is on foot. */
export function onFoot({ graph, ones }: Pick<Editing, "graph" | "ones">, id: string | undefined): boolean {
  const spawn = ones.find((one) => one.id === id)?.spawn;
  return spawn !== undefined && graph.place(spawn)?.walk === true;
}

export const placeHover = (place: Place | null, trial?: Trial): Hover | null =>
  place && { is: "place", place, trial };
