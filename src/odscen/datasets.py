"""Datasets for learners: made of runs, and the arrays of runs and scenarios.

>>> from odscen import datasets
>>> datasets.make_dataset(workspace, "dataset.toml", "out", processes=2)
>>> arrays = datasets.read_arrays("out/train/shard-0000/Town01-0007.npz")
"""

from odscen.app.exchange.exports import export_run, export_runs
from odscen.app.learner_arrays import scenario_arrays, scenario_from_arrays
from odscen.experiments.datasets import (
    DatasetFacts,
    DatasetPlan,
    make_dataset,
    read_dataset_plan,
)
from odscen.learning.hetero_data import arrays_of, hetero_data, read_arrays

__all__ = [
    "DatasetFacts",
    "DatasetPlan",
    "arrays_of",
    "export_run",
    "export_runs",
    "hetero_data",
    "make_dataset",
    "read_arrays",
    "read_dataset_plan",
    "scenario_arrays",
    "scenario_from_arrays",
]
