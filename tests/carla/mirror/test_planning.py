"""What is planned for a tick, without any server."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.base.errors import CarlaError, InputError
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.mirrored import Mirror, between
from odscen.carla.mirror.nearby import HYSTERESIS, Nearby
from odscen.carla.server.batch import BRAKE, FOG, LEFT, LIFTS, LOW_BEAM, POSITION, RIGHT, Batch
from odscen.carla.server.blueprints import Shape, choose_blueprints
from odscen.carla.server.environment import vehicle_lights
from odscen.convert.lane_table.light_heads import SignalHeads
from odscen.convert.lane_table.table import SumoLight
from odscen.records.run_plan import Plan, PlannedActor
from odscen.simulators.assets import shipped_assets
from odscen.sumo.runner.in_step import Step


def actor(name: str, category: str = "car", *, length: float = 4.5, **more: object) -> PlannedActor:
    return PlannedActor(name, category, "", None, 0.0, length, 1.8, 0.0, 0.0, 0.0, 0.0, **more)  # type: ignore[arg-type]


def plan_of(*actors: PlannedActor) -> Plan:
    return Plan("test", 0, 60.0, 1.0, (0.0, 0.0), actors)


def step_of(time: float, places: dict[int, tuple[float, float]], *, signals: int = 0) -> Step:
    count = len(places)
    return Step(
        time=time,
        index=np.array(list(places), dtype=np.int64),
        ids=np.array(list(places)).astype(np.str_),
        x=np.array([x for x, _ in places.values()]),
        y=np.array([y for _, y in places.values()]),
        z=np.zeros(count),
        hdg=np.zeros(count),
        pitch=np.zeros(count),
        speed=np.full(count, 5.0),
        signals=np.full(count, signals),
    )


class Server:
    """Takes every spawn that it is not told to refuse."""

    def __init__(self, mirror: Mirror, *, refuse: int = 0) -> None:
        self.mirror, self.refuse, self.next = mirror, refuse, 100
        self.batches: list[Batch] = []

    def show(self, step: Step, ticks: int = 1) -> Batch:
        for batch in self.mirror.batches(step, [k / ticks for k in range(1, ticks + 1)]):
            answers: list[int | str] = []
            for _ in batch.spawn:
                if self.refuse:
                    self.refuse -= 1
                    answers.append("collision")
                else:
                    answers.append(self.next)
                    self.next += 1
            self.mirror.answered(answers)
            self.batches.append(batch)
        return self.batches[-1]


def server_of(*actors: PlannedActor, refuse: int = 0, **options: object) -> Server:
    plan = plan_of(*actors)
    names = ["vehicle.x"] * len(actors)
    shapes = {"vehicle.x": Shape((2.0, 1.0, 0.8))}
    return Server(Mirror(plan, names, shapes, **options), refuse=refuse)  # type: ignore[arg-type]


def test_everybody_is_made_moved_and_taken_away_with_sumo() -> None:
    server = server_of(actor("a"), actor("b"))
    assert [s.role_name for s in server.show(step_of(0.0, {0: (0, 0)})).spawn] == ["odscen.a"]
    second = server.show(step_of(1.0, {0: (5, 0), 1: (0, 9)}))
    assert [(m.actor, m.at.x) for m in second.move] == [(100, 5.0)]
    assert [(s.role_name, s.at.y) for s in second.spawn] == [("odscen.b", -9.0)]
    third = server.show(step_of(2.0, {1: (5, 9)}))
    assert third.destroy == (100,)
    assert [m.actor for m in third.move] == [101]


def test_a_refused_spawn_is_tried_higher_up_and_forgotten_once_it_is_there() -> None:
    server = server_of(actor("a"), refuse=2)
    lifts = [server.show(step_of(t, {0: (0, 0)})).spawn[0].lift for t in (0.0, 1.0, 2.0)]
    assert lifts == list(LIFTS)
    assert not server.mirror.refusals
    assert server.show(step_of(3.0, {0: (1, 0)})).move


def test_a_walker_is_made_with_its_feet_clear_of_the_ground_and_put_on_it() -> None:
    mirror = Mirror(
        plan_of(actor("p", "pedestrian")), ["walker"], {"walker": Shape((0.2, 0.2, 0.9))}
    )
    (spawn,) = Server(mirror).show(step_of(0.0, {0: (3, 0)})).spawn
    assert (spawn.at.z, spawn.lift) == (0.0, 0.9 + LIFTS[0])
    assert LIFTS[0] >= 0.15


def test_whoever_is_always_refused_is_tried_now_and_then_and_named() -> None:
    server = server_of(actor("a"), refuse=1000)
    tries = [len(server.show(step_of(float(t), {0: (0, 0)})).spawn) for t in range(40)]
    assert 4 <= sum(tries) <= 10
    assert server.mirror.refusals[0].reason == "collision"


def test_ticks_between_steps_lead_from_one_to_the_other() -> None:
    server = server_of(actor("a"))
    server.show(step_of(0.0, {0: (0, 0)}))
    server.show(step_of(1.0, {0: (4, 0)}), ticks=4)
    assert [b.move[0].at.x for b in server.batches[1:]] == pytest.approx([1.0, 2.0, 3.0, 4.0])


def test_a_teleport_is_no_flight_across_town() -> None:
    last, now = step_of(0.0, {0: (0, 0)}), step_of(1.0, {0: (300, 0)})
    assert between(last, now, 0.5).x == pytest.approx([0.0])


def test_headings_turn_the_short_way() -> None:
    last, now = step_of(0.0, {0: (0, 0)}), step_of(1.0, {0: (1, 0)})
    last.hdg[:], now.hdg[:] = 3.1, -3.1
    assert abs(float(between(last, now, 0.5).hdg[0])) == pytest.approx(np.pi, abs=1e-6)


def test_lights_are_switched_when_they_change_and_not_every_tick() -> None:
    server = server_of(actor("a"), lights=LOW_BEAM)
    assert server.show(step_of(0.0, {0: (0, 0)}, signals=8)).spawn[0].flags == LOW_BEAM | BRAKE
    assert server.show(step_of(1.0, {0: (0, 0)}, signals=8)).shine == ()
    hazard = server.show(step_of(2.0, {0: (0, 0)}, signals=4)).shine
    assert [s.flags for s in hazard] == [LOW_BEAM | LEFT | RIGHT]


def test_only_who_is_near_the_ego_is_shown_and_no_flicker_at_the_edge() -> None:
    near = {"nearby": Nearby(radius=50.0)}
    server = server_of(actor("ego", ego=True), actor("a"), **near)
    edge = 50.0 * HYSTERESIS
    shown = []
    for time, x in enumerate((60.0, 49.0, 55.0, edge - 0.1, edge + 0.1, 55.0)):
        server.show(step_of(float(time), {0: (0, 0), 1: (x, 0)}))
        shown.append(1 in server.mirror.actors)
    assert shown == [False, True, True, True, False, False]


def test_pedestrians_where_a_large_map_is_dormant_are_not_shown_and_vehicles_are() -> None:
    server = server_of(
        actor("ego", ego=True), actor("walker", "pedestrian"), actor("far"), walkers_within=1800.0
    )
    batch = server.show(step_of(0.0, {0: (0.0, 0.0), 1: (1900.0, 0.0), 2: (1900.0, 5.0)}))
    assert [spawn.role_name for spawn in batch.spawn] == ["odscen.ego", "odscen.far"]
    batch = server.show(step_of(1.0, {0: (200.0, 0.0), 1: (1900.0, 0.0), 2: (1900.0, 5.0)}))
    assert [spawn.role_name for spawn in batch.spawn] == ["odscen.walker"]
    batch = server.show(step_of(2.0, {0: (0.0, 0.0), 1: (1900.0, 0.0), 2: (1900.0, 5.0)}))
    assert len(batch.destroy) == 1


def test_the_middle_of_a_box_beside_its_origin_is_on_the_body_centre() -> None:
    plan = plan_of(actor("a"))
    shapes = {"vehicle.x": Shape((2.0, 1.0, 0.8), (0.5, 0.2, 0.8))}
    server = Server(Mirror(plan, ["vehicle.x"], shapes))
    [spawn] = server.show(step_of(0.0, {0: (10.0, 3.0)})).spawn
    # CARLA's y is to the right, and south.
    assert spawn.at.x + 0.5 == pytest.approx(10.0)
    assert spawn.at.y + 0.2 == pytest.approx(-3.0)


def test_a_cap_keeps_the_nearest() -> None:
    server = server_of(
        actor("ego", ego=True), actor("a"), actor("b"), actor("c"), nearby=Nearby(most=2)
    )
    server.show(step_of(0.0, {0: (0, 0), 1: (90, 0), 2: (10, 0), 3: (50, 0)}))
    assert set(server.mirror.actors) == {0, 2}


def test_models_of_the_plan_are_kept_and_others_chosen_by_size_the_same_way_each_time() -> None:
    assets = shipped_assets()
    library = [name for name in assets.blueprints if name != "vehicle.audi.tt"]
    actors = [
        actor("a", model="vehicle.tesla.model3"),
        actor("b", model="vehicle.audi.tt", length=4.2),
        actor("c", "bus", length=12.0),
        actor("d", "pedestrian", length=0.3),
    ]
    chosen = choose_blueprints(actors, assets, library)
    assert chosen == choose_blueprints(actors, assets, reversed(library))
    assert chosen[0] == "vehicle.tesla.model3"
    kinds = [assets.blueprints[name].category.value for name in chosen]
    assert kinds == ["car", "car", "bus", "pedestrian"]
    with pytest.raises(CarlaError, match="no blueprint for a pedestrian"):
        choose_blueprints(actors, assets, ["vehicle.tesla.model3"])


def test_a_signal_over_several_links_shows_green_if_any_of_them_may_go() -> None:
    light = SumoLight("J1", (), (), 0.0, (("7",), ("7", "8"), (), ("9",)))
    heads = SignalHeads([light])
    assert heads.signals == {"7", "8", "9"}
    assert heads.states({"J1": "rGGy"}) == {"7": "Green", "8": "Green", "9": "Yellow"}
    assert heads.states({"J1": "ryru"}) == {"7": "Yellow", "8": "Yellow", "9": "Yellow"}


def test_letters_of_a_light_are_made_from_what_its_signals_show() -> None:
    heads = SignalHeads([SumoLight("t", (), (), 0.0, (("a",), ("a", "b"), ("c",), ()))])
    assert heads.letters({"a": "Red", "b": "Green"}) == {"t": "rG--"}
    assert heads.letters({"a": "Yellow", "b": "Red", "c": "Off"}) == {"t": "yyo-"}
    assert heads.letters({}) == {}


def test_lights_are_on_at_night_in_rain_and_in_fog() -> None:
    presets = shipped_assets().presets
    assert vehicle_lights(presets["ClearNoon"].parameters) == 0
    assert vehicle_lights(presets["ClearNight"].parameters) == POSITION | LOW_BEAM
    assert vehicle_lights({"fog_density": 80.0}) == POSITION | LOW_BEAM | FOG


def test_a_step_is_a_whole_number_of_ticks() -> None:
    assert CosimOptions().ticks(0.5) == 10
    assert CosimOptions().ticks(0.02) == 1
    assert CosimOptions(tick=0.1).ticks(0.3) == 3
    with pytest.raises(InputError, match="no whole number"):
        CosimOptions(tick=0.2).ticks(0.5)
