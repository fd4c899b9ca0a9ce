"""How a road user drives or walks: the attributes of a vType, from category, style and weather.

Nothing is left to SUMO's random numbers: each actor's speed factor is drawn here, from the
scenario's seed and the actor's id, and written down, and nobody dawdles (``sigma`` 0). In Krauss'
model a driver dawdles by up to ``sigma * accel * step`` in every step, so that the same driver
needs longer headways the longer the steps: at a stop line 14 % fewer vehicles pass with steps of
1 s than of 0.1 s. Without it capacity hardly depends on the step; docs/runs.md has the figures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.distributions import draw_key, stream
from odscen.scenario.document.driver_parameters import DRIVER_PARAMETERS
from odscen.scenario.document.drivers_document import Drivers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.categories import Body
    from odscen.scenario.document.drivers_document import DrivingStyle
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.weather_effects import WeatherEffect


@dataclass(frozen=True, slots=True)
class CategoryTraits:
    """What SUMO needs to know of a category; m/s and m/s^2; emission class of SUMO's models."""

    vclass: str
    max_speed: float
    accel: float
    decel: float
    emergency_decel: float
    shape: str
    emissions: str


KINDS: dict[Category, CategoryTraits] = {
    # https://sumo.dlr.de/docs/Vehicle_Type_Parameter_Defaults.html, SUMO 1.28
    Category.CAR: CategoryTraits(
        "passenger", 55.56, 2.6, 4.0, 9.0, "passenger", "HBEFA4/PC_petrol_Euro-4"
    ),
    Category.VAN: CategoryTraits(
        "delivery", 55.56, 2.6, 4.0, 9.0, "delivery", "HBEFA4/LCV_diesel_N1-III_Euro-6ab"
    ),
    Category.TRUCK: CategoryTraits(
        "truck", 36.11, 1.3, 3.5, 7.0, "truck", "HBEFA4/RT_le7.5t_Euro-VI_A-C"
    ),
    Category.BUS: CategoryTraits(
        "bus", 27.78, 1.2, 3.5, 7.0, "bus", "HBEFA4/UBus_Std_gt15-18t_Euro-VI_A-C"
    ),
    Category.MOTORCYCLE: CategoryTraits(
        "motorcycle", 55.56, 4.0, 4.0, 10.0, "motorcycle", "HBEFA4/MC_4S_gt250cc_Euro-3"
    ),
    Category.BICYCLE: CategoryTraits("bicycle", 5.56, 1.2, 3.0, 7.0, "bicycle", "Zero"),
    Category.PEDESTRIAN: CategoryTraits("pedestrian", 1.39, 1.5, 2.0, 5.0, "pedestrian", "Zero"),
}
"""Bicycles and pedestrians: the speed they usually go at, 20 and 5 km/h.

``decel`` is what drivers brake with who see early what they brake for: at lights 15, 50 and 85 % of
those who stop brake with less than 2.2, 3.0 and 3.9 m/s2 (Gates, Noyce, Laracuente and Nordheim,
"Analysis of driver behavior in dilemma zones at signalized intersections", Transportation Research
Record 2030, 2007). SUMO's 4.5 is what they do in emergencies (NCHRP Report 400), as is what it has
for motorcycles. With 3.5 up to a fifth fewer of those who wait for gaps would get away.

SUMO's ``accel`` of motorcycles, 6.0, is what a machine does at full throttle: from there to braking
within a step of 0.5 s is a jerk of more than 20 m/s3. Riders take 4.0, which is odscen's choice.

Emissions: https://sumo.dlr.de/docs/Models/Emissions/HBEFA4-based.html; the classes that SUMO 1.28
itself takes, but for motorcycles, of which it takes those from before 1999.
"""
ELECTRIC: dict[Category, str] = {
    Category.CAR: "HBEFA4/PC_BEV",
    Category.VAN: "HBEFA4/LCV_BEV_N1-IIII",
    Category.TRUCK: "HBEFA4/RigidTruck_BEV_le7.5t",
    Category.BUS: "HBEFA4/Coach_BEV_Std_le18t",
    Category.MOTORCYCLE: "HBEFA4/MC_BEV",
}
"""Emission classes of models that are electric."""


@dataclass(frozen=True, slots=True)
class Style:
    """A driving style; the speed factor is normally distributed and cut at 3 deviations.

    ``accel`` and ``headway`` multiply those of the category and of normal drivers;
    ``gap_acceptance`` is added to theirs.
    """

    factor_mean: float
    factor_deviation: float
    accel: float
    headway: float
    gap_acceptance: float
    min_gap: float


STYLES: dict[DrivingStyle, Style] = {
    # "normal" carries as much as the Highway Capacity Manual says, see docs/runs.md.
    "cautious": Style(0.90, 0.05, 0.8, 1.5, -0.3, 2.5),
    "normal": Style(1.00, 0.08, 1.0, 1.0, 0.0, 2.0),
    "sporty": Style(1.10, 0.06, 1.2, 0.9, 0.2, 1.5),
}
HEADWAY = 1.1
"""Seconds that normal drivers keep from the rear in front."""
PASSING = 0.57
"""Seconds in which a car from a queue passes its length and gap at a stop line, at about 12 m/s."""
NORMAL_DRIVERS = Drivers()
WALKING_DEVIATION = 0.1
"""Of the speed factor of pedestrians for whom no speed is given."""
TEMPERS = 8
"""Kinds of drivers that those of flows and demand are divided into, equally many of each, so that
few vTypes have to be written."""
HEADWAY_DEVIATION = 0.38
"""Of the logarithm of the desired headway.

Those of drivers who follow are spread log-normally with 0.3 to 0.5: Treiber and Kesting, "Traffic
Flow Dynamics", 2013, chapter 4; Brackstone, Waterson and McDonald, "Determinants of following
headway in congested traffic", Transportation Research Part F 12, 2009.
"""
SPEED_CORRELATION = -0.4
"""Of the desired headway with the speed factor: who drives fast follows closely (there)."""
EAGER_ACCELERATION = 0.15
"""Of the logarithm of the acceleration: who follows closely accelerates more."""
LATERAL_SHARE = 0.3
"""Of its speed that a vehicle moves aside at most, beside :data:`LATERAL_STANDING`: 17 degrees of
heading."""
LATERAL_STANDING = 0.5
"""m/s that a stopped vehicle moves aside at most: with none, who has come to the end of its lane
never leaves it."""
OVERTAKES_RIGHT = "1"
"""Probability of overtaking on the right. With SUMO's 0 drivers who come up to slower ones on the
left brake as hard as they do at all until they have 60 km/h, speed up and brake again."""
ALWAYS = 1_000_000
"""Seconds after the beginning of red in which it is not heeded; more than any red lasts."""
TWO_WHEELER_MIN_GAP = 0.5
"""Share of a driver's gap that motorcycles and bicycles keep."""


@dataclass(frozen=True, slots=True)
class Driver:
    """A vType's attributes and what belongs to the single vehicle.

    Attributes
    ----------
    attributes
        Of the ``<vType>``, in order, without its id.
    max_speed
        Highest speed the actor ever goes, m/s.
    speed_factor
        Times the speed limit; 1 for pedestrians, whose own speed is in ``max_speed``.
    """

    attributes: tuple[tuple[str, str], ...]
    max_speed: float
    speed_factor: float
    accel: float


@dataclass(frozen=True, slots=True)
class DriverKind:
    """How one driver drives: a style, and what a driver set says instead, each drawn.

    ``drawn`` has SUMO's parameters by name; ``car_following`` is empty for SUMO's default model.
    ``temper`` is how much headway a driver wants: standard normal, 0 is the mean driver.
    """

    style: DrivingStyle = "normal"
    drawn: Mapping[str, float] = field(default_factory=dict)
    car_following: str = ""
    temper: float = 0.0


NORMAL_KIND = DriverKind()


def kind_of(user: RoadUser, drivers: Drivers, seed: int) -> DriverKind:
    """Kind of a road user, the same whatever else is in the scenario.

    Members of flows and demand draw their style by the shares of ``drivers``, and how closely they
    follow; single actors are the mean driver of their style. Of a driver set each draws its own
    parameters.

    Raises
    ------
    ScenarioError
        If the actor names a style that there is not.
    """
    name = user.design.style
    if user.flow is not None and drivers.shares:
        name = draw_key(drivers.shares, stream(seed, "driving style", user.id))
    for driver_set in drivers.sets:
        if driver_set.id == name:
            drawn = {
                parameter: round(values.draw(stream(seed, parameter, user.id)), 4)
                for parameter, values in driver_set.parameters.items()
            }
            model = driver_set.car_following
            return DriverKind(driver_set.style, drawn, "" if model == "Krauss" else model)
    for style in STYLES:
        if style == name:
            return DriverKind(
                style, temper=0.0 if user.flow is None else draw_temper(seed, user.id)
            )
    raise ScenarioError(
        f"{user.id!r} drives as {name!r}, which is neither a driving style nor a driver set"
    )


def draw_temper(seed: int, actor: str) -> float:
    """How much headway one driver wants, correlated with its speed factor; one of a few values."""
    fast = float(stream(seed, "speed factor", actor).normal())
    own = float(stream(seed, "headway", actor).normal())
    z = SPEED_CORRELATION * fast + math.sqrt(1.0 - SPEED_CORRELATION**2) * own
    share = 0.5 * (1.0 + math.erf(z / math.sqrt(2.0)))
    group = min(TEMPERS - 1, int(share * TEMPERS))
    return NormalDist().inv_cdf((group + 0.5) / TEMPERS)


@lru_cache(maxsize=1024)
def spread_headway(temper: float, mean: float, least: float) -> float:
    """Headway that a driver of this temper keeps, seconds.

    Parameters
    ----------
    temper
        As of :func:`draw_temper`; 0 is the mean driver.
    mean, least
        Of all tempers, seconds. None is shorter than ``least``; the others keep less for it, so
        that the mean holds as long as it is longer.
    """
    if not temper or mean <= least:
        return mean
    spread = [NormalDist().inv_cdf((group + 0.5) / TEMPERS) for group in range(TEMPERS)]
    shares = [math.exp(HEADWAY_DEVIATION * z) for z in spread]
    low, high = 0.0, mean * TEMPERS
    for _ in range(60):
        middle = 0.5 * (low + high)
        enough = sum(max(middle * share, least) for share in shares) >= mean * TEMPERS
        low, high = (low, middle) if enough else (middle, high)
    return max(high * math.exp(HEADWAY_DEVIATION * temper), least)


def draw_factor(seed: int, actor: str, style: DrivingStyle, category: Category) -> float:
    """Speed factor of one actor, the same whatever else is in the scenario."""
    z = float(stream(seed, "speed factor", actor).normal())
    z = min(3.0, max(-3.0, z))
    if category is Category.PEDESTRIAN:
        return round(1.0 + WALKING_DEVIATION * z, 4)
    drawn = STYLES[style]
    return round(drawn.factor_mean + drawn.factor_deviation * z, 4)


def factor_of(user: RoadUser, kind: DriverKind, seed: int) -> float:
    """Speed factor of a road user: that of its driver set, else drawn by its style."""
    own = kind.drawn.get("speedFactor")
    return draw_factor(seed, user.id, kind.style, user.category) if own is None else own


def driver(
    user: RoadUser,
    body: Body,
    *,
    factor: float,
    limit: float | None,
    weather: WeatherEffect,
    electric: bool = False,
    drivers: Drivers = NORMAL_DRIVERS,
    step_length: float = 0.0,
    kind: DriverKind = NORMAL_KIND,
) -> Driver:
    """Attributes of a road user that drives, or walks, like this.

    Parameters
    ----------
    user
        Says category and the desired speed (m/s). A vehicle never goes faster. Where it is
        above ``limit * factor``, the factor is raised so that the desired speed is reached at the
        spawn, and other limits are exceeded in the same proportion.
    factor
        Drawn speed factor, see :func:`draw_factor`.
    limit
        Speed limit at the spawn, m/s; ``None`` if unknown.
    electric
        Whether the model has no exhaust.
    drivers
        What the scenario says of all drivers.
    step_length
        Seconds; nobody keeps a shorter headway, in which SUMO could not keep them from colliding.
    kind
        Style and drawn parameters, see :func:`kind_of`; a drawn speed factor is in ``factor``.
    """
    category, speed = user.category, user.speed
    if category is Category.PEDESTRIAN:
        speed = KINDS[category].max_speed * factor if speed is None else speed
        return _make_walker(user, body, speed=speed)
    traits = KINDS[category]
    max_speed = traits.max_speed
    if speed is not None:
        max_speed = speed
        if limit:
            factor = max(factor, speed / limit)
    max_speed = min(max_speed * weather.speed, weather.sight_speed)
    factor *= weather.speed
    values = _driver_parameters(category, kind, drivers, step_length)
    accel = values.pop("accel") * weather.grip
    attributes = (
        ("vClass", traits.vclass),
        ("guiShape", traits.shape),
        *_body_attributes(body),
        *((("carFollowModel", kind.car_following),) if kind.car_following else ()),
        ("maxSpeed", number(max_speed)),
        ("speedDev", "0"),
        ("accel", number(accel)),
        ("decel", number(values.pop("decel") * weather.grip)),
        ("emergencyDecel", number(values.pop("emergencyDecel") * weather.grip)),
        ("tau", number(max(values.pop("tau"), step_length) * weather.headway)),
        ("sigma", number(values.pop("sigma"))),
        ("minGap", number(values.pop("minGap"))),
        ("lcMaxSpeedLatStanding", number(LATERAL_STANDING)),
        ("lcMaxSpeedLatFactor", number(LATERAL_SHARE)),
        *(() if "lcOvertakeRight" in values else (("lcOvertakeRight", OVERTAKES_RIGHT),)),
        *((name, number(values[name])) for name in DRIVER_PARAMETERS if name in values),
        (
            "emissionClass",
            ELECTRIC.get(category, traits.emissions) if electric else traits.emissions,
        ),
    )
    return Driver(attributes, max_speed, round(factor, 4), accel)


def _driver_parameters(
    category: Category, kind: DriverKind, drivers: Drivers, step_length: float
) -> dict[str, float]:
    """SUMO's parameters of a driver before weather; what is SUMO's default is left out."""
    traits, style = KINDS[category], STYLES[kind.style]
    two_wheeler = category in (Category.MOTORCYCLE, Category.BICYCLE)
    values = {
        "accel": traits.accel * style.accel * math.exp(-EAGER_ACCELERATION * kind.temper),
        "decel": traits.decel,
        "emergencyDecel": traits.emergency_decel,
        "tau": spread_headway(kind.temper, normal_headway(drivers) * style.headway, step_length),
        "sigma": 0.0,
        "minGap": style.min_gap * (TWO_WHEELER_MIN_GAP if two_wheeler else 1.0),
        **_gaps_and_changes(style, drivers),
        **kind.drawn,
    }
    values.pop("speedFactor", None)  # written at each vehicle
    values["emergencyDecel"] = max(values["emergencyDecel"], values["decel"])
    return values


def normal_headway(drivers: Drivers) -> float:
    """Seconds from the rear in front that normal drivers keep.

    ``3600 / saturation_flow = headway + PASSING``
    """
    if drivers.saturation_flow is not None:
        return 3600.0 / drivers.saturation_flow - PASSING
    return HEADWAY if drivers.headway is None else drivers.headway


def _gaps_and_changes(style: Style, drivers: Drivers) -> dict[str, float]:
    accepts = min(1.0, max(0.0, drivers.gap_acceptance + style.gap_acceptance))
    found = {"impatience": accepts} if accepts else {}
    eagerness = drivers.lane_change_eagerness
    return found | ({"lcSpeedGain": eagerness} if eagerness != 1.0 else {})


def _make_walker(user: RoadUser, body: Body, *, speed: float) -> Driver:
    attributes = (
        ("vClass", "pedestrian"),
        ("guiShape", "pedestrian"),
        *_body_attributes(body),
        ("maxSpeed", number(speed)),
        ("desiredMaxSpeed", number(speed)),
        ("speedFactor", "1"),
        ("speedDev", "0"),
        ("emissionClass", KINDS[Category.PEDESTRIAN].emissions),
    )
    if user.design.ignores_red:
        attributes += (("jmDriveAfterRedTime", number(ALWAYS, digits=0)),)
    return Driver(attributes, speed, 1.0, KINDS[Category.PEDESTRIAN].accel)


def _body_attributes(body: Body) -> tuple[tuple[str, str], ...]:
    return (
        ("length", number(body.length)),
        ("width", number(body.width)),
        ("height", number(body.height)),
    )


def number(value: float, *, digits: int = 3) -> str:
    """Write fixed notation with ``digits`` decimals, without trailing zeros and without ``-0``."""
    text = f"{value:.{digits}f}"
    if digits > 0:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
