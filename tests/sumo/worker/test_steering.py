from __future__ import annotations

import os

from odscen.sumo.worker.protocol import Command, Pace, encode
from odscen.sumo.worker.steering import Steering


def test_no_command_is_lost_when_the_next_slice_begins_in_a_process_of_its_own() -> None:
    """What was heard is handed over, and what comes later is left for the new process to hear."""
    ear, mouth = os.pipe()
    os.write(mouth, encode(Command("frame")).encode())
    first = Steering(ear, Pace(speed=2.0), step_length=0.5)
    while first.next_step(lambda _: None) and not first.frame_wanted:
        pass
    pace, *heard = first.hand_over()
    os.write(mouth, encode(Command("stop")).encode())
    assert pace == Pace(speed=2.0)
    commands = [command for command in heard if isinstance(command, Command)]
    assert commands == [Command("frame")]
    second = Steering(ear, Pace(speed=2.0), step_length=0.5, heard=commands)
    while second.next_step(lambda _: None):
        pass
    assert second.frame_wanted
    assert second.stopped
    os.close(mouth)


def test_a_run_that_is_paused_at_a_boundary_stays_paused_without_another_step() -> None:
    ear, mouth = os.pipe()
    heard = [Command("pause"), Command("step")]
    steering = Steering(ear, Pace(), step_length=0.5, heard=heard)
    assert steering.next_step(lambda _: None)
    assert steering.pace == Pace(paused=True)
    assert steering.hand_over() == [Pace(), Command("pause")]
    os.close(mouth)
