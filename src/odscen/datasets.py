"""Datasets for learners: made of runs, and the arrays of runs and scenarios.

>>> from odscen import datasets
>>> datasets.make_dataset(workspace, "dataset.toml", "out", processes=2)
>>> runs = datasets.open_dataset("out", split="train")
>>> arrays = runs[0]  # read when it is asked for, with the map of its shard
>>> for batch in datasets.batches(runs, 8, **runs.sizes):  # one shape, for JAX or torch
...     print(batch["agent_state"].shape)
"""

from odscen.app.exchange.exports import export_run, export_runs
from odscen.app.learner_arrays import scenario_arrays, scenario_from_arrays
from odscen.experiments.dataset_card import DatasetFacts
from odscen.experiments.dataset_plan import DatasetPlan, read_dataset_plan
from odscen.experiments.datasets import make_dataset
from odscen.learning.hetero_data import arrays_of, hetero_data, read_arrays
from odscen.learning.run_datasets import RunDataset, batches, open_dataset, padded_batch

__all__ = [
    "DatasetFacts",
    "DatasetPlan",
    "RunDataset",
    "arrays_of",
    "batches",
    "export_run",
    "export_runs",
    "hetero_data",
    "make_dataset",
    "open_dataset",
    "padded_batch",
    "read_arrays",
    "read_dataset_plan",
    "scenario_arrays",
    "scenario_from_arrays",
]
