from collections import Counter

import pytest

from odscen.catalog.assets import shipped_assets
from odscen.categories import Body, Category
from odscen.errors import NotFoundError


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
    assert len(presets) == 22
    for preset in presets:
        theirs = getattr(carla.WeatherParameters, preset.name)
        for key, value in preset.parameters.items():
            assert value == pytest.approx(getattr(theirs, key), abs=1e-4), (preset.name, key)
