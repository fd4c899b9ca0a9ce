import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydantic import ValidationError

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.demand.count_stations import StationFinder, contradictions, geh
from odscen.scenario.demand.day_profiles import BUILT_IN, DAY, Curve, curve
from odscen.scenario.demand.demand_tables import (
    MOST_ROWS,
    read_counts,
    read_matrix,
    read_profile,
    read_zones,
)
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import (
    Background,
    Counts,
    Demand,
    Matrix,
    Profile,
    Scenario,
)
from tests.graphs import fork

GRAPH = fork()


def scenario() -> Scenario:
    return edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))


def codes(one: Scenario) -> list[str]:
    return sorted({p.code for p in check(one, GRAPH) if p.code != "no_actors"})


def counts(*rows: tuple[str, float, float, float]) -> Counts:
    return Counts.model_validate({"id": "survey", "rows": rows})


@given(
    st.lists(st.floats(0, 100), min_size=1, max_size=48).filter(lambda s: sum(s) > 1e-3),
    st.floats(0, DAY - 1),
    st.floats(0, 1),
)
@example(shares=[2e-311, 1.0], clock=1.0, quantile=0.0)
def test_times_drawn_from_a_profile_have_the_share_that_it_gives_them(
    shares: list[float], clock: float, quantile: float
) -> None:
    drawn = Curve(tuple(shares), clock=clock)
    assert drawn.amount(DAY) == pytest.approx(DAY, rel=1e-6)
    time = float(drawn.draw(np.array([quantile]), begin=0.0, end=DAY)[0])
    assert 0 <= time <= DAY
    assert drawn.amount(time) == pytest.approx(quantile * DAY, abs=1.0)


def test_a_weekday_is_busiest_in_the_afternoon_and_quiet_at_night() -> None:
    times = Curve(BUILT_IN["weekday"]).draw(np.linspace(0, 1, 10_001), begin=0, end=DAY)
    hours = np.histogram(times, bins=24, range=(0, DAY))[0]
    assert hours.argmax() == 17
    assert hours[0:5].max() < hours[7] / 5


def test_a_run_that_starts_at_noon_gets_the_demand_of_the_afternoon_first() -> None:
    noon = Curve(BUILT_IN["weekday"], clock=DAY / 2)
    assert noon.amount(6 * 3600) > 1.5 * Curve(BUILT_IN["weekday"]).amount(6 * 3600)


def test_demand_survives_being_written_and_read() -> None:
    one = edits.set_zone(scenario(), GRAPH, zone="ends", segments=["r2", "r3"])
    one = edits.set_matrix(one, GRAPH, matrix="m", trips=[("r1", "ends", 2.5)], profile="weekday")
    one = edits.set_counts(one, GRAPH, counts="c", rows=[("r1>j9", 0, 900, 4)])
    one = edits.set_background(one, GRAPH, background="b", per_km=4)
    assert loads(dumps(one)) == one
    assert codes(one) == []
    assert dumps(one).count("\n") < 40


def test_a_scenario_without_demand_is_written_as_before() -> None:
    assert "demand" not in dumps(scenario())


def test_background_traffic_has_one_amount() -> None:
    with pytest.raises(ValueError, match="one of fill, per_km and trips, not none"):
        Background(id="b")
    one = edits.set_background(scenario(), GRAPH, background="b", per_km=4)
    two = edits.set_background(one, GRAPH, background="b", trips=100)
    assert (two.demand.background[0].per_km, two.demand.background[0].trips) == (None, 100)


def test_an_edit_of_the_same_name_changes_the_part_and_another_adds_one() -> None:
    one = edits.set_matrix(scenario(), GRAPH, matrix="m", trips=[("r1", "r2", 2)])
    one = edits.set_matrix(one, GRAPH, matrix="m", profile="weekend")
    one = edits.set_matrix(one, GRAPH, matrix="n", trips=[("r1", "r3", 2)])
    assert [(m.id, m.profile, m.trips[0][1]) for m in one.demand.matrices] == [
        ("m", "weekend", "r2"),
        ("n", None, "r3"),
    ]
    left = edits.remove_demand(one, GRAPH, part="m")
    assert [m.id for m in left.demand.matrices] == ["n"]
    with pytest.raises(NotFoundError, match="did you mean n"):
        edits.remove_demand(left, GRAPH, part="nn")


def test_what_is_in_use_cannot_be_removed() -> None:
    one = edits.set_zone(scenario(), GRAPH, zone="ends", segments=["r2"])
    one = edits.set_matrix(one, GRAPH, matrix="m", trips=[("r1", "ends", 2)])
    with pytest.raises(ScenarioError, match="'ends' is neither a zone nor a segment"):
        edits.remove_demand(one, GRAPH, part="ends")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trips": [("r1", "r77", 1)]}, "'r77' is neither a zone nor a segment"),
        ({"trips": [("r1", "r2", 1), ("r1", "r2", 3)]}, "given 2 times"),
        ({"trips": [("r1", "r2", 1)], "profile": "monday"}, "there are weekday, weekend"),
        ({"trips": [("r1", "r2", 1)], "begin": 5, "end": 5}, "not after it begins"),
        ({"trips": [("r1", "r2", -1)]}, "greater than or equal to 0"),
    ],
)
def test_a_matrix_that_cannot_be_right_is_refused(change: dict, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        edits.set_matrix(scenario(), GRAPH, matrix="m", **change)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([("r77", 0, 900, 1)], "'r77', which the map does not have"),
        ([("r1>r2", 0, 900, 1)], "no lane leads from 'r1' into 'r2'"),
        ([("r1", 0, 900, 1), ("r1", 0, 900, 2)], "counted 2 times: 1 and 2"),
        ([("r1", 0, 900, 1), ("r2", 450, 1350, 2)], "does not fit that of the first row"),
    ],
)
def test_counts_that_cannot_be_right_are_refused(rows: list, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        edits.set_counts(scenario(), GRAPH, counts="c", rows=rows)


def test_names_are_shared_with_actors_and_flows() -> None:
    one = edits.add_actor(scenario(), GRAPH, category="car", spawn="1.0.-1.10", id="rush")
    with pytest.raises(ScenarioError, match="'rush' is taken"):
        edits.set_matrix(one, GRAPH, matrix="rush", trips=[("r1", "r2", 1)])


def test_turns_that_add_up_to_more_than_their_flow_are_named() -> None:
    survey = counts(("r1>j9", 0, 900, 50), ("r1>j9>r2", 0, 900, 40), ("r1>j9>r3", 0, 900, 30))
    found = list(contradictions(survey, GRAPH))
    assert [(one.places, one.begin) for one in found] == [(("r1>j9", "r1>j9>r2", "r1>j9>r3"), 0.0)]
    assert "50 were counted at r1>j9" in found[0].message
    assert "add up to 70" in found[0].message
    one = edits.set_counts(scenario(), GRAPH, counts="survey", rows=survey.rows)
    assert codes(one) == ["counts_contradict"]


def test_a_junction_that_more_enter_than_leave_is_named() -> None:
    survey = counts(("r1>j9", 0, 900, 90), ("j9>r2", 0, 900, 40), ("j9>r3", 0, 900, 20))
    messages = [one.message for one in contradictions(survey, GRAPH)]
    assert messages == ["90 were counted on all entries of j9, but 60 on all exits"]


def test_counts_a_few_vehicles_apart_do_not_contradict_each_other() -> None:
    survey = counts(("r1>j9", 0, 900, 90), ("j9>r2", 0, 900, 62), ("j9>r3", 0, 900, 31))
    assert list(contradictions(survey, GRAPH)) == []


def test_geh_is_that_of_the_textbook() -> None:
    assert geh(1200, 1000, 3600) == pytest.approx(6.03, abs=0.005)
    assert geh(300, 250, 900) == pytest.approx(geh(1200, 1000, 3600))
    assert geh(0, 0, 900) == 0.0


def test_a_route_passes_flows_turns_and_segments() -> None:
    passing = StationFinder(GRAPH, ["r1>j9>r2", "r2", "r1>j9", "r1>j9>r3", "nowhere"])
    row = {name: index for index, name in enumerate(GRAPH.segments.ids)}
    passed = passing.of([row["r1"], row["j9"], row["r2"]])
    assert [(passing.places[place], step) for place, step in passed] == [
        ("r1>j9", 1),
        ("r1>j9>r2", 2),
        ("r2", 2),
    ]


def test_tables_are_read_with_seconds_or_times_of_day() -> None:
    text = "place;begin;end;count\nr1 > j9;7:00;7:15;12\nr1>j9;26100;27000;9\n"
    assert read_counts(text) == (
        (("r1>j9", 25200, 26100, 12), ("r1>j9", 26100, 27000, 9)),
        (2, 3),
    )
    assert read_counts(text.splitlines()[0] + "\nr1;7:00;7:15;12", clock=25200).values == (
        ("r1", 0, 900, 12),
    )
    assert read_matrix("from,to,trips\n\na,b,3\n") == {None: ((("a", "b", 3),), (3,))}
    sliced = read_matrix("from,to,trips,begin,end\na,b,3,0,900\na,b,4,900,1800\nb,a,1,0,900\n")
    assert sliced == {
        (0, 900): ((("a", "b", 3), ("b", "a", 1)), (2, 4)),
        (900, 1800): ((("a", "b", 4),), (3,)),
    }
    assert read_profile("time,share\n0:00,1\n12:00,3\n") == ((1, 3), None, None)
    seven_to_nine = "time,share\n" + "".join(
        f"{7 + k // 4}:{15 * (k % 4):02},{k}\n" for k in range(8)
    )
    assert read_profile(seven_to_nine) == (tuple(range(8)), 7 * 3600, 9 * 3600)
    assert read_zones("zone,segment\nn,r1\nn,r2\n") == {"n": (("r1", "r2"), (2, 3))}


@pytest.mark.parametrize(
    ("read", "text", "message"),
    [
        (read_matrix, "from,to,number\na,b,3\n", "line 1.*needed are from, to, trips"),
        (read_matrix, "from,to,trips\na,b,many\n", "line 2: trips must be a number.*'many'"),
        (read_matrix, "from,to,trips\na,b\n", "line 2: 2 values for 3 columns"),
        (read_matrix, "from,to,trips\n", "no lines below the first"),
        (read_counts, "place,begin,end,count\nr1,900,0,3\n", "line 2: the slice from 900 to 0"),
        (read_profile, "time,share\n0:00,1\n7:00,3\n13:00,3\n", "line 4: time '13:00'"),
        (read_profile, "time,share\n0:00,1\n13:00,3\n", "line 3: 2 slices of 780 min end after"),
        (read_profile, "time,share\n7:00,1\n", "line 2: one slice has no length"),
        (read_profile, "time,share\n9:00,1\n7:00,1\n", "line 3: time '7:00' is not after '9:00'"),
        (read_zones, "zone,segment\nold town,r1\n", "line 2: zone must be .*not 'old town'"),
        (read_counts, "place,begin,end,count\nr1," + "9" * 200_000, "line 2: this is no table"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_its_line(read, text, message) -> None:
    with pytest.raises(InputError, match=message):
        read(text)


@pytest.mark.slow
def test_a_table_has_as_many_lines_as_it_may_have_and_no_more() -> None:
    assert len(read_profile("share\n" + "1\n" * MOST_ROWS).shares) == MOST_ROWS
    with pytest.raises(InputError, match=r"^line 500002: there are more than 500000 lines"):
        read_profile("share\n" + "1\n" * (MOST_ROWS + 1))


def test_a_number_of_400_digits_is_refused_in_a_short_message() -> None:
    with pytest.raises(InputError, match=r"^line 2: share must be a number from 0 on") as caught:
        read_profile("share\n" + "9" * 400 + "\n")
    assert len(str(caught.value)) < 150


def test_a_mix_of_a_matrix_may_hold_all_seven_categories() -> None:
    mix = dict.fromkeys(("car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian"), 1)
    matrix = Matrix.model_validate({"id": "m", "trips": [("a", "b", 1)], "mix": mix})
    assert len(matrix.mix) == 7


def test_a_profile_between_clock_times_has_its_slices_there_and_nothing_else() -> None:
    early = Profile(id="early", shares=(1, 1, 2, 4, 4, 2, 1, 1), begin=7 * 3600, end=9 * 3600)
    found = curve(Demand(profiles=(early,)), "early")
    quarter = [found.amount(t + 900.0) - found.amount(t) for t in range(0, 86_400, 900)]
    assert sum(quarter[:28]) == sum(quarter[36:]) == 0.0
    # The mean of these two hours is 1: what is said of an hour is said of them.
    assert quarter[28:36] == pytest.approx([7200.0 * k / 16 for k in (1, 1, 2, 4, 4, 2, 1, 1)])
    next_day = found.amount(86_400.0 + 8 * 3600.0) - found.amount(86_400.0)
    assert next_day == pytest.approx(3600.0)
    drawn = found.draw(np.linspace(0, 1, 9), begin=86_400.0, end=2 * 86_400.0)
    assert drawn[4] == pytest.approx(86_400.0 + 8 * 3600.0)


@pytest.mark.parametrize(
    "times", [{"begin": 7 * 3600}, {"begin": 3600, "end": 3600}, {"begin": 0, "end": 7210}]
)
def test_a_profile_of_a_part_of_the_day_needs_both_ends_and_whole_minutes(times) -> None:
    with pytest.raises(ValidationError):
        Profile(id="early", shares=(1, 2), **times)


def test_few_shares_of_a_whole_day_and_trips_to_the_same_segment_are_warned_of() -> None:
    few, many = Profile(id="peak", shares=(1,) * 8), Profile(id="noon", shares=(1,) * 24)
    early = Profile(id="early", shares=(1,) * 8, begin=7 * 3600, end=9 * 3600)
    matrix = Matrix(id="od", trips=(("r1", "r1", 5.0), ("r1", "r2", 5.0)))
    one = scenario().model_copy(
        update={"demand": Demand(profiles=(few, many, early), matrices=(matrix,))}
    )
    found = {
        p.where: p for p in check(one, GRAPH) if p.code in ("profile_over_day", "trip_to_itself")
    }
    assert set(found) == {"demand.profiles[0].shares", "demand.matrices[0].trips[0]"}
    assert {p.severity for p in found.values()} == {"warning"}
    words = found["demand.profiles[0].shares"].message
    assert words.startswith("the 8 shares of profile 'peak' are slices of 3 h each")
