/** The terms of the page, each in one plain sentence; in the order in which one meets them. */
export const TERMS: readonly (readonly [term: string, meaning: string])[] = [
  [
    "Region of interest (study area)",
    "The connected roads and junctions in which road users start and the scenario takes place.",
  ],
  [
    "Segment",
    "A road between two junctions, or a junction: the piece of the map of which a region consists.",
  ],
  ["Road user", "A vehicle or a pedestrian that is placed by hand or comes with the traffic."],
  ["Start", "The point on a lane or walkway where a road user enters (spawns)."],
  ["Goal", "The point where its trip ends; if none is chosen, a random one that can be reached."],
  ["Route", "The sequence of roads and lanes from the start to the goal."],
  ["Connection", "The lane through a junction that leads from one lane to another."],
  [
    "Flow, pedestrian flow",
    "Vehicles or pedestrians that keep entering at one point, at a given number per hour.",
  ],
  [
    "Demand",
    "All trips that are to be made: background traffic, trips between zones, and counts to be reproduced.",
  ],
  ["Background traffic", "Vehicles with random starts and goals, as many as you ask for."],
  ["Zone", "A name for several segments between which trips are made."],
  ["Count station", "A place where vehicles were counted, to be compared with the simulation."],
  ["GEH", "The usual measure of how far a simulated flow is from a counted one; 5 or less is good."],
  ["Driving style", "How a driver behaves: cautious, normal or sporty gaps, speeds and accelerations."],
  ["Ego", "Your vehicle under test."],
  ["Random seed", "The number that all random choices follow from: the same seed gives the same traffic."],
  [
    "Fixed-time, actuated",
    "A fixed-time signal keeps its times; an actuated one extends its green while vehicles arrive.",
  ],
  ["Intergreen", "The time between two conflicting greens: yellow and all-red."],
  [
    "Not inserted",
    "A vehicle for which there was no room on the road at its time of departure; it waits until there is.",
  ],
  ["Gridlock", "Vehicles that block each other in a circle, so that none of them can move."],
  [
    "Teleported",
    "Removed from the road after waiting 300 s (unless set otherwise), and put back further along its route.",
  ],
  ["Control delay", "The time that a signal or sign costs a vehicle, compared with driving on freely."],
  ["Delay", "Travel time beyond that of driving freely at the speed limit."],
  [
    "Level of service",
    "Grade of a junction or road from A (free) to F (over capacity), by its delay or density.",
  ],
  ["Time to collision", "Seconds until two road users would meet if neither changed its speed."],
];
