"""What of a map is lost for traffic, or guessed, as counted beside its name."""

from __future__ import annotations

from odscen.maps.traffic_losses import traffic_losses


def entry(fate: str, element: str, reason: str) -> dict[str, str]:
    return {"fate": fate, "element": element, "reason": reason}


def test_losses_and_guesses_are_counted_by_kind() -> None:
    report = {
        "entries": [
            entry(
                "lost", "signals of type SE A20", "3 signs that are not understood have no effect"
            ),
            entry("lost", "road 1 > signal 7", "it controls no movement"),
            entry("lost", "road 1 > signal 8", "it controls no movement"),
            entry("guessed", "road 2 > signal 9", "no lane for vehicles comes from where it faces"),
            entry(
                "guessed",
                "road 2 > signal 3",
                "every crossing of a junction with lights has a light",
            ),
            entry("lost", "road 3 > laneSection 0 > lane -1", "open both ways; SUMO has it in one"),
            entry("lost", "road 4", "length is missing; the road is left out [road-left-out]"),
            entry("repaired", "road 5", "5 m against 9 m; 9 m holds [road-length]"),
            entry("repaired", "road 6 > lane 1", "it leads to lane 1, which alone states the link"),
            entry("repaired", "road 6", "a mark is left out [paint]"),
            entry(
                "lost",
                "road 7",
                "lanes of type restricted, on which no access allows vehicles: left out",
            ),
            entry("lost", "road 8 > lane 1", "access: deny xyz has no vehicle class in SUMO"),
            entry("lost", "road 9", "the temporary lane layer is left out [temporary-lanes]"),
            entry("kept", "map", "12 connections between lanes"),
            entry("guessed", "map", "2 traffic lights have programs of odscen's own"),
        ]
    }
    losses = traffic_losses(report)
    assert losses.lost == {
        "access_rules": 1,
        "lanes_both_ways": 1,
        "roads": 1,
        "signals": 2,
        "temporary_lanes": 1,
        "unknown_signs": 3,
    }
    assert losses.guessed == {"connections": 1, "road_lengths": 1, "signals": 1}
    assert str(losses) == (
        "; lost for traffic: 1 access rule, 1 lane open both ways, 1 road, 2 lights and signs, "
        "1 road with temporary lanes, 3 signs not understood"
        "; guessed: 1 connection, 1 length of a road, 1 light or sign"
    )


def test_a_map_that_lost_nothing_says_nothing() -> None:
    assert str(traffic_losses({"entries": [entry("kept", "map", "all")]})) == ""
    assert traffic_losses({}).lost == {}
