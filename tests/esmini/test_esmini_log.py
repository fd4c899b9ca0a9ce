"""The table that esmini logs, as it grows."""

from __future__ import annotations

import math

import pytest

from odscen.base.errors import InputError
from odscen.esmini.esmini_log import EsminiLog

COLUMNS = (
    "Entity_Name [-]", "Entity_ID [-]", "Current_Speed [m/s]", "Wheel_Angle [deg]", "bb_x [m]",
    "bb_y [m]", "World_Position_X [m]", "World_Position_Y [m]", "World_Position_Z [m]", "lane_id",
    "World_Heading_Angle [rad]", "collision_ids",
)  # fmt: skip
HEADER = "Index [-], TimeStamp [s], " + "".join(
    f"#{number} {name}, " for number in (1, 2) for name in COLUMNS
)
QUARTER = math.pi / 2


def logged(name: str, number: int, *, hdg: float = 0.0, touched: str = "") -> str:
    place = "10.000000, 20.000000, 0.500000"
    return f"{name}, {number}, -3.5, 0.0, 1.4, 0.2, {place}, -1, {hdg:.6f}, {touched}, "


def test_the_middle_of_a_box_is_ahead_of_where_the_reference_point_is() -> None:
    table = f"esmini GIT REV: v\n{HEADER}\n0, 0.000000, {logged('van', 4, hdg=QUARTER)}\n"
    ((time, (van,)),) = EsminiLog().take(table)
    assert time == 0.0
    assert (van.name, van.number, van.speed, van.touched) == ("van", 4, -3.5, ())
    assert (van.x, van.y, van.z) == pytest.approx((9.8, 21.4, 0.5), abs=1e-5)


def test_steps_in_which_nobody_is_there_have_no_end_of_line() -> None:
    table = f"{HEADER}\n0, 0.000000, 1, 0.100000, 2, 0.200000, {logged('7', 3)}\n3, 0.300000, "
    assert [(time, len(there)) for time, there in EsminiLog().take(table)] == [
        (0.0, 0), (0.1, 0), (0.2, 1),
    ]  # fmt: skip


def test_pieces_of_any_size_give_the_same_steps() -> None:
    both = logged("a", 0, touched="1 ") + logged("b", 1, touched="0 ")
    table = f"{HEADER}\n0, 0.000000, {both}\n1, 0.100000, {logged('b', 1)}\n"
    whole = list(EsminiLog().take(table))
    assert [entity.touched for entity in whole[0][1]] == [(1,), (0,)]
    for size in (1, 7, 50):
        log = EsminiLog()
        parts = [table[at : at + size] for at in range(0, len(table), size)]
        assert [step for part in parts for step in log.take(part)] == whole


def test_a_missing_column_and_a_row_of_another_width_are_errors() -> None:
    with pytest.raises(InputError, match="esmini logs no World_Heading_Angle"):
        list(EsminiLog().take(HEADER.replace("World_Heading_Angle", "Yaw") + "\n"))
    with pytest.raises(InputError, match="3 columns are no entities of 12"):
        list(EsminiLog().take(f"{HEADER}\n0, 0.000000, a, 0, 1.0, \n"))
    with pytest.raises(InputError, match="not as its header says"):
        list(EsminiLog().take(f"{HEADER}\n0, 0.000000, {logged('a', 0).replace('1.4', 'x')}\n"))
