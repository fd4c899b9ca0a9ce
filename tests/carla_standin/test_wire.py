"""Bytes that a real client has been seen to accept; a wrong length would abort its process."""

from __future__ import annotations

from tests.carla_standin import wire


def test_a_token_names_stream_and_port_and_leaves_the_host_to_the_client() -> None:
    assert wire.token(1, 2001).hex() == "01000000d1070100" + 16 * "00"


def test_a_state_message_has_the_layout_of_the_release() -> None:
    control = (0.5, -0.25, 0.1, True, False, True, 3)
    record = wire.actor_record(
        24,
        (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        (7.0, 8.0, 9.0),
        (10.0, 11.0, 12.0),
        (13.0, 14.0, 15.0),
        wire.VEHICLE_TAIL.pack(*control, 30.0, 2, False, 0, 0),
    )
    message = wire.state_message(
        frame=7,
        elapsed=0.35,
        delta=0.05,
        episode=0x1122334455667788,
        platform_time=1000.0,
        records=[record],
    )
    header = "1100000000000000 0700000000000000 666666666666d63f" + 24 * "00"
    episode = "8877665544332211 0000000000408f40 cdcc4c3d" + 16 * "00"
    vehicle = (
        "18000000 01 0000803f0000004000004040 000080400000a0400000c040"
        "0000e0400000004100001041 000020410000304100004041 000050410000604100007041"
        "0000003f000080becdcccc3d 010001 03000000 0000f041 02 00 00000000 00" + 24 * "00"
    )
    assert message == bytes.fromhex(header + episode + vehicle)


def test_a_pose_survives_there_and_back() -> None:
    at = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert wire.pose(wire.transform(at)) == at
