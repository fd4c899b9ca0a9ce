"""Hypothesis strategies for the parts of a scenario document; valid, not necessarily runnable."""

from hypothesis import strategies as st

from odscen.base.categories import Category
from odscen.scenario.document.distributions import Constant, Uniform
from odscen.scenario.document.drivers_document import Drivers, DriverSet
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import (
    Actor,
    Background,
    BodySize,
    Counts,
    Demand,
    Environment,
    Flow,
    MapReference,
    Matrix,
    Profile,
    Scenario,
    Zone,
)
from odscen.scenario.document.signals_document import JunctionTiming, Signals

finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp")), max_size=20
)
labels = names.filter(lambda text: len(text) > 0 and "\ufffe" not in text and "\uffff" not in text)
actors = st.builds(
    Actor,
    id=st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,20}", fullmatch=True),
    category=st.sampled_from(Category),
    model=st.none() | labels,
    spawn=labels,
    goal=st.none() | labels,
    via=st.lists(labels, max_size=3).map(tuple),
    speed=st.none() | st.floats(0, 100, exclude_min=True),
    lateral_offset=st.floats(-10, 10),
    longitudinal_offset=st.floats(-10, 10),
    size=st.none() | st.builds(BodySize, length=st.floats(0.1, 30), width=st.floats(0.1, 5)),
    depart=st.floats(0, 1e6),
    initial_speed=st.none() | st.floats(0, 100),
    style=st.sampled_from(["cautious", "normal", "sporty"]),
    ego=st.booleans(),
    crosses_anywhere=st.booleans(),
    ignores_red=st.booleans(),
)
flows = st.builds(
    Flow,
    id=st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,20}", fullmatch=True),
    spawn=labels,
    goal=st.none() | labels,
    per_hour=st.floats(0, 20_000, exclude_min=True),
    begin=st.floats(0, 1e6),
    end=st.floats(0, 1e6),
    mix=st.dictionaries(
        st.sampled_from(Category), st.floats(0, 1e3, exclude_min=True), min_size=1, max_size=3
    ),
    speed=st.none() | st.floats(0, 100, exclude_min=True),
    initial_speed=st.none() | st.floats(0, 100),
)
environments = st.builds(
    Environment,
    preset=labels,
    parameters=st.dictionaries(labels, finite, max_size=3),
    affects_driving=st.booleans(),
)
controls = st.sampled_from(["fixed", "actuated"])
timings = st.builds(
    JunctionTiming,
    junction=labels,
    control=st.none() | controls,
    offset=st.floats(0, 3600),
    green=st.lists(st.floats(0, 3600), max_size=3).map(tuple),
)
driver_sets = st.builds(
    DriverSet,
    id=st.from_regex(r"set-[a-z]{1,8}", fullmatch=True),
    style=st.sampled_from(["cautious", "normal", "sporty"]),
    parameters=st.dictionaries(
        st.sampled_from(["tau", "minGap", "accel"]),
        st.floats(0.5, 5).map(lambda value: Constant(value=value))
        | st.floats(0.5, 5).map(lambda low: Uniform(low=low, high=low + 1.0)),
    ),
)
manners = {
    "sets": st.lists(driver_sets, max_size=2, unique_by=lambda one: one.id).map(tuple),
    "shares": st.dictionaries(st.sampled_from(["cautious", "normal"]), st.floats(0.1, 9)),
    "gap_acceptance": st.floats(0, 1),
    "lane_change_eagerness": st.floats(0, 10),
}
drivers = st.builds(Drivers, headway=st.none() | st.floats(0.5, 5), **manners) | st.builds(
    Drivers, saturation_flow=st.floats(800, 2500), **manners
)
signals = st.builds(Signals, control=controls, junctions=st.lists(timings, max_size=3).map(tuple))
identifiers = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,20}", fullmatch=True)
mixes = st.dictionaries(
    st.sampled_from(Category), st.floats(0, 1e3, exclude_min=True), min_size=1, max_size=3
)
numbers = st.floats(0, 1e6)
windows = {
    "id": identifiers,
    "begin": st.floats(0, 1e6),
    "end": st.none() | st.floats(0, 1e6),
    "profile": st.none() | identifiers,
    "mix": mixes,
}
demands = st.builds(
    Demand,
    clock=st.floats(0, 86_399),
    zones=st.lists(
        st.builds(
            Zone, id=identifiers, segments=st.lists(labels, min_size=1, max_size=3).map(tuple)
        ),
        max_size=2,
    ).map(tuple),
    profiles=st.lists(
        st.builds(
            Profile,
            id=identifiers,
            shares=st.lists(st.floats(0.5, 10), min_size=1, max_size=4).map(tuple),
        ),
        max_size=2,
    ).map(tuple),
    matrices=st.lists(
        st.builds(
            Matrix,
            **windows,
            trips=st.lists(st.tuples(labels, labels, numbers), min_size=1, max_size=3).map(tuple),
        ),
        max_size=2,
    ).map(tuple),
    counts=st.lists(
        st.builds(
            Counts,
            id=identifiers,
            mix=mixes,
            rows=st.lists(st.tuples(labels, numbers, numbers, numbers), min_size=1, max_size=3).map(
                tuple
            ),
        ),
        max_size=2,
    ).map(tuple),
    background=st.lists(
        st.builds(Background, **windows, per_km=st.floats(0.5, 100)), max_size=2
    ).map(tuple),
)
RULES = (
    StoryRule.model_validate(
        {
            "id": "cut-in",
            "actor": "van",
            "when": {"any": [{"not": {"speed": {"above": 3.5}}}, {"ttc": {"to": "b", "below": 3}}]},
            "then": [{"lane": {"by": -1}}, {"together": [{"stop": {}}, {"ignore": {}}]}],
        }
    ),
)
scenarios = st.builds(
    Scenario,
    name=labels,
    description=names,
    map=st.just(MapReference(name="toy", sha256="0" * 64)),
    seed=st.integers(0, 2**31 - 1),
    roi=st.lists(labels, max_size=4).map(tuple),
    environment=environments,
    drivers=drivers,
    actors=st.lists(actors, max_size=4).map(tuple),
    flows=st.lists(flows, max_size=3).map(tuple),
    signals=signals,
    demand=demands,
    rules=st.sampled_from([(), RULES]),
)
