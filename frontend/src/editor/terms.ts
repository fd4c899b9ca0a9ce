import { t } from "@lingui/core/macro";

import { localized } from "../language/localized";

/** The terms of the page, each in one plain sentence; in the order in which one meets them. */
export const TERMS = localized((): readonly (readonly [term: string, meaning: string])[] => [
  [
    t`Region of interest (study area)`,
    t`The connected roads and junctions in which road users start and the scenario takes place.`,
  ],
  [
    t`Segment`,
    t`A road between two junctions, or a junction: the piece of the map of which a region consists.`,
  ],
  [t`Road user`, t`A vehicle or a pedestrian that is placed by hand or comes with the traffic.`],
  [t`Start`, t`The point on a lane or walkway where a road user enters (spawns).`],
  [t`Goal`, t`The point where its trip ends; if none is chosen, a random one that can be reached.`],
  [t`Route`, t`The sequence of roads and lanes from the start to the goal.`],
  [t`Connection`, t`The lane through a junction that leads from one lane to another.`],
  [
    t`Flow, pedestrian flow`,
    t`Vehicles or pedestrians that keep entering at one point, at a given number per hour.`,
  ],
  [
    t`Demand`,
    t`All trips that are to be made: background traffic, trips between zones, and counts to be reproduced.`,
  ],
  [t`Background traffic`, t`Vehicles with random starts and goals, as many as you ask for.`],
  [t`Zone`, t`A name for several segments between which trips are made.`],
  [t`Count station`, t`A place where vehicles were counted, to be compared with the simulation.`],
  ["GEH", t`The usual measure of how far a simulated flow is from a counted one; 5 or less is good.`],
  [t`Driving style`, t`How a driver behaves: cautious, normal or sporty gaps, speeds and accelerations.`],
  [t`Ego`, t`Your vehicle under test.`],
  [t`Random seed`, t`The number that all random choices follow from: the same seed gives the same traffic.`],
  [
    t`Fixed-time, actuated`,
    t`A fixed-time signal keeps its times; an actuated one extends its green while vehicles arrive.`,
  ],
  [t`Intergreen`, t`The time between two conflicting greens: yellow and all-red.`],
  [
    t`Not inserted`,
    t`A vehicle for which there was no room on the road at its time of departure; it waits until there is.`,
  ],
  [t`Gridlock`, t`Vehicles that block each other in a circle, so that none of them can move.`],
  [
    t`Teleported`,
    t`Removed from the road after waiting 300 s (unless set otherwise), and put back further along its route.`,
  ],
  [t`Control delay`, t`The time that a signal or sign costs a vehicle, compared with driving on freely.`],
  [t`Delay`, t`Travel time beyond that of driving freely at the speed limit.`],
  [
    t`Level of service`,
    t`Grade of a junction or road from A (free) to F (over capacity), by its delay or density.`,
  ],
  [t`Time to collision`, t`Seconds until two road users would meet if neither changed its speed.`],
]);
