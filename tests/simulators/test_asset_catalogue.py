import json
from collections import Counter
from importlib.resources import files

import pytest

from odscen.base.categories import Body, Category
from odscen.base.errors import NotFoundError
from odscen.simulators.assets import shipped_assets


def test_the_catalogue_has_every_blueprint_of_carla_0_9_16():
    counts = Counter(model.category for model in shipped_assets().blueprints.values())
    assert counts == {
        Category.CAR: 25,
        Category.VAN: 4,
        Category.TRUCK: 4,
        Category.BUS: 1,
        Category.MOTORCYCLE: 4,
        Category.BICYCLE: 3,
        Category.PEDESTRIAN: 52,
    }


def test_sizes_are_those_measured_on_a_server():
    assets = shipped_assets()
    assert assets.dimensions("vehicle.tesla.model3") == Body(4.7918, 2.1635, 1.4877)
    assert assets.dimensions("walker.pedestrian.0009") == Body(0.5, 0.5, 1.1)


def test_all_bodies_have_a_plausible_size():
    for model in shipped_assets().blueprints.values():
        assert 0.3 < model.body.length < 12, model
        assert 0.3 < model.body.width < 4, model
        assert 1.0 < model.body.height < 4.5, model


def test_no_size_is_guessed_and_each_names_a_source_of_its_file():
    text = (files("odscen.maps") / "data" / "blueprints.json").read_text(encoding="utf-8")
    named = {model.dimensions_source for model in shipped_assets().blueprints.values()}
    assert named == {"scenic"}
    assert named <= set(json.loads(text)["sources"])


def test_ids_are_those_of_a_server():
    walkers = [model.id for model in shipped_assets().of_category(Category.PEDESTRIAN)]
    assert walkers == [f"walker.pedestrian.{number:04}" for number in range(1, 53)]
    vehicles = [name for name in shipped_assets().blueprints if name.startswith("vehicle.")]
    assert len(vehicles) == 41
    # Names of older releases, which a 0.9.16 server refuses.
    assert not {"vehicle.bmw.isetta", "vehicle.mustang.mustang"} & set(vehicles)
    assert "vehicle.sixwheeltruck.sixwheeltruck" not in vehicles


def test_special_types_are_those_of_carlas_catalogue():
    found = {}
    for model in shipped_assets().blueprints.values():
        if model.special_type:
            found.setdefault(model.special_type, set()).add(model.id.removeprefix("vehicle."))
    assert found == {
        "electric": {
            "audi.etron",
            "micro.microlino",
            "tesla.cybertruck",
            "tesla.model3",
            "toyota.prius",
        },
        "emergency": {
            "carlamotors.firetruck",
            "dodge.charger_police",
            "dodge.charger_police_2020",
            "ford.ambulance",
        },
        "taxi": {"ford.crown"},
    }


def test_base_types_agree_with_categories_or_are_empty_as_on_a_server():
    vehicles = [m for m in shipped_assets().blueprints.values() if m.id.startswith("vehicle.")]
    empty = {model.id for model in vehicles if not model.base_type}
    assert empty == {"vehicle.bmw.grandtourer", "vehicle.mini.cooper_s"}
    assert all(m.base_type == m.category for m in vehicles if m.base_type)


def test_children_are_known_and_smaller_than_adults():
    walkers = shipped_assets().of_category(Category.PEDESTRIAN)
    assert Counter(model.age for model in walkers) == {"adult": 40, "child": 8, None: 4}
    assert {m.body.height for m in walkers if m.age == "child"} == {1.1, 1.3}
    assert {m.body.height for m in walkers if m.age == "adult"} == {1.86}


def test_an_unknown_model_is_answered_with_close_ones():
    with pytest.raises(
        NotFoundError, match=r"'vehicle\.tesla\.model4'; did you mean vehicle\.tesla"
    ):
        shipped_assets().blueprint("vehicle.tesla.model4")


def test_an_unknown_preset_is_answered_with_close_ones():
    with pytest.raises(NotFoundError, match="did you mean ClearNoon"):
        shipped_assets().preset("ClearNon")


def test_every_kind_of_weather_exists_by_day_at_sunset_and_by_night():
    found = {(preset.kind, preset.time_of_day) for preset in shipped_assets().presets.values()}
    kinds = ("clear", "cloudy", "wet", "rain_light", "rain_medium", "rain_heavy", "fog", "dust")
    assert {(kind, time) for kind in kinds for time in ("day", "sunset", "night")} <= found


def test_carlas_presets_have_carlas_values():
    carla = pytest.importorskip("carla", reason="needs the carla package")
    presets = [p for p in shipped_assets().presets.values() if p.source == "carla"]
    kind = carla.WeatherParameters
    theirs = {name for name in dir(kind) if isinstance(getattr(kind, name), kind)}
    assert {preset.name for preset in presets} == theirs - {"Default"}
    for preset in presets:
        wanted = getattr(kind, preset.name)
        for key, value in preset.parameters.items():
            assert value == pytest.approx(getattr(wanted, key), abs=1e-4), (preset.name, key)


def test_every_preset_sets_every_parameter_of_carla():
    carla = pytest.importorskip("carla", reason="needs the carla package")
    kind = carla.WeatherParameters
    names = {n for n in dir(kind) if isinstance(getattr(kind, n), property)}
    assert len(names) == 14
    for preset in shipped_assets().presets.values():
        assert set(preset.parameters) == names, preset.name


def test_the_fog_that_makes_carlas_nights_dark_does_not_slow_traffic_down():
    assets = shipped_assets()
    assert assets.preset("HardRainNight").parameters["fog_density"] == 100
    assert assets.weather("HardRainNight")["fog_density"] == 0
    assert assets.weather("FogNight")["fog_density"] == 85
