"""The simulators there are, by name: those that ship, and those of installed packages."""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.learning.offered_models import installed_names, named_object, offered_models
from odscen.learning.offered_options import values_for
from odscen.simulators.base import Simulator

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_models import OfferedModel
    from odscen.learning.offered_options import OptionValue
    from odscen.simulators.base import AnySimulator

GROUP = "odscen.simulators"
"""Of entry points."""
SUMO, CARLA_MIRROR, CARLA_NATIVE = "sumo", "carla-mirror", "carla-native"
METADRIVE, ESMINI = "metadrive", "esmini"
_SHIPPED = {
    SUMO: "odscen.sumo.runner.sumo_simulator:SumoSimulator",
    CARLA_MIRROR: "odscen.carla.mirror.cosim:CarlaMirror",
    CARLA_NATIVE: "odscen.carla.native.native_run:CarlaNative",
    METADRIVE: "odscen.metadrive.metadrive_run:MetaDrive",
    ESMINI: "odscen.esmini.esmini_run:Esmini",
}
"""Named and not imported: each lies above this room."""
_NO_OPTIONS: Mapping[str, OptionValue] = MappingProxyType({})


def simulator_names() -> list[str]:
    """Names of all simulators there are, those that ship first."""
    return installed_names(GROUP, _SHIPPED)


def installed_simulators() -> tuple[OfferedModel, ...]:
    """All simulators there are, with their options, or why one cannot be used."""
    return offered_models(simulator_names(), _find_class)


def open_simulator(
    name: str, options: Mapping[str, OptionValue] = _NO_OPTIONS, *, installed_only: bool = False
) -> AnySimulator:
    """Find a simulator and make it with its options.

    Parameters
    ----------
    installed_only
        Take names of the list alone, and none of a module or file.

    Raises
    ------
    InputError
        If there is none of this name, it cannot be imported or made, or an option is not possible.
    """
    if installed_only and name not in simulator_names():
        raise _unknown_simulator(name)
    found = _find_class(name)
    values = values_for(found, options, name=name)
    try:
        made = found(**values) if isinstance(found, type) else found
    except InputError:
        raise
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"it cannot be made: {error!r}", element=name) from error
    if not isinstance(made, Simulator):
        raise InputError("it is no odscen.simulators.base.Simulator", element=name)
    return made


def _unknown_simulator(name: str) -> InputError:
    names = ", ".join(simulator_names())
    return InputError(f"there is no simulator {name!r}; there are {names}", element="simulator")


def _find_class(name: str) -> Any:
    if name in _SHIPPED:
        module, _, attribute = _SHIPPED[name].partition(":")
        return getattr(import_module(module), attribute)
    if ":" not in name and name not in simulator_names():
        raise _unknown_simulator(name)
    return named_object(name, group=GROUP, what="simulator", shipped=f"{', '.join(_SHIPPED)} ship")
