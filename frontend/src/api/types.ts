import type { components } from "./schema";

/** What goes between the page and the server, by the page's names; `schema.ts` is made by `make api`. */
type Schemas = components["schemas"];

export type Category = Schemas["Category"];
/** The order of the interface. */
export const CATEGORIES: readonly Category[] = [
  "car",
  "van",
  "truck",
  "bus",
  "motorcycle",
  "bicycle",
  "pedestrian",
];

export type MapStatistics = Schemas["MapStatistics"];
export type Bounds = MapStatistics["bounds"];
export type MapInfo = Schemas["MapInfo"];
export type NetworkOrigin = Schemas["NetworkOrigin"];
/** Who writes the network of a map that is added; null keeps the network of one that is there. */
export type Converter = Exclude<NetworkOrigin["converter"], "file"> | null;
export type MapDetails = Schemas["MapDetails"];
export type GraphColumns = Schemas["GraphColumns"];
/** What the names of the places of a map are made of. */
export type MapNames = Schemas["MapNames"];
export type Side = Schemas["LegInfo"]["side"];
export type HeightColumns = Schemas["HeightColumns"];
export type WalkColumns = Schemas["WalkColumns"];
export type PackedLines = Schemas["PackedLines"];
export type PackedDrawing = Schemas["DrawingColumns"];
export type ConversionReport = Schemas["ConversionInfo"];
export type MapImporter = Schemas["ImporterInfo"];
/** What became of an element of the map. */
export type ElementOutcome = ConversionReport["entries"][number]["fate"];

export type Assets = Schemas["AssetsInfo"];
export type WeatherPreset = Schemas["WeatherInfo"];

export type ScenarioDocument = Schemas["Scenario"];
export type Actor = Schemas["Actor"];
export type Flow = Schemas["Flow"];
export type DrivingStyle = Schemas["DriverSet-Output"]["style"];
export type SignalControl = Schemas["Signals"]["control"];
export type Problem = Schemas["ProblemInfo"];
export type ScenarioState = Schemas["ScenarioState"];
/** What has changed of a scenario, in place of all of it. */
export type ScenarioPatch = Schemas["ScenarioPatch"];
export type DocumentChange = Schemas["DocumentChange"];
export type ScenarioEntry = Schemas["ScenarioRow"];
export type Job = Schemas["JobInfo"];
/** Which segments are inside, and which may be added or taken out now. */
export type Roi = Schemas["RoiInfo"];

/** One change; `kind` is the name of a function of `odscen.scenario.edits`. */
export type Edit = Schemas["EditRequest"]["edits"][number];
/** Arguments of one kind of edit. */
export type EditOf<K extends Edit["kind"]> = Extract<Edit, { kind: K }>;
/** Fields that an edit changes, without those that say what is changed. */
export type FieldsOf<K extends Edit["kind"], Subject extends keyof EditOf<K>> = Omit<
  EditOf<K>,
  "kind" | Subject
>;
