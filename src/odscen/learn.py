"""Learned traffic: generators that fill a map, models that drive, and training both.

A generator is a class with ``fill(graph, request, rng)``, a behaviour model one with ``init`` and
``act``; ``GeneratorDoor`` and ``BehaviourDoor`` say where one comes from.

>>> from odscen import learn
>>> odscen.generate(workspace, settings=settings, generator=learn.GeneratorDoor("mine.py:Mine"))
"""

from odscen.app.generators import GeneratorDoor, installed_generators
from odscen.app.learned.evaluation import TrafficQuality, evaluate_model
from odscen.app.learned.learned_driving import DrivingError, learn_driving
from odscen.app.learned.model_files import read_model, train
from odscen.app.learned.snapshot_data import DataSettings, MadeShard, make_shards, read_shards
from odscen.learning.behaviour.behaviour_model import (
    BehaviourDoor,
    BehaviourModel,
    BehaviourScene,
    DrivingAction,
    DrivingKind,
    LightAhead,
    RoadObservation,
)
from odscen.learning.fill import CheckedFill, Fill, FillRequest, Generator
from odscen.learning.reference.model_training import TrainingSettings

__all__ = [
    "BehaviourDoor",
    "BehaviourModel",
    "BehaviourScene",
    "CheckedFill",
    "DataSettings",
    "DrivingAction",
    "DrivingError",
    "DrivingKind",
    "Fill",
    "FillRequest",
    "Generator",
    "GeneratorDoor",
    "LightAhead",
    "MadeShard",
    "RoadObservation",
    "TrafficQuality",
    "TrainingSettings",
    "evaluate_model",
    "installed_generators",
    "learn_driving",
    "make_shards",
    "read_model",
    "read_shards",
    "train",
]
