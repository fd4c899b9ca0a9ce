"""The card of a dataset: what it has, in Markdown for people and JSON for programs."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.categories import Category
from odscen.experiments.dataset_plan import split_word
from odscen.formats.recordings.track_statistics import SPEED_STEP
from odscen.learning.run_datasets import HUGGINGFACE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.experiments.dataset_plan import DatasetPlan

STATISTICS = ("planned", "arrived", "collided", "mean_speed", "mean_delay")
"""Figures of runs that the card gives the mean of."""
_WHOLE_MAP: Final = ("scenarionet", "waymo", "commonroad")
"""Formats whose files each have the map."""


@dataclass(frozen=True, slots=True)
class MapFacts:
    """A map of a dataset, and what its runs have together.

    Attributes
    ----------
    sha256
        Of the .xodr.
    runs
        How many are in the dataset.
    seconds
        Of all recordings.
    most
        Sizes of the arrays of the run with the most: ``agents``, ``lights``, ``steps``, ``lanes``.
    categories
        See :func:`~odscen.formats.recordings.track_statistics.track_statistics`.
    picture
        File of its picture, if it has one.
    """

    name: str
    sha256: str
    split: str
    runs: int = 0
    seconds: float = 0.0
    most: Mapping[str, int] = field(default_factory=dict)
    categories: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    picture: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "name": self.name,
            "sha256": self.sha256,
            "split": self.split,
            "runs": self.runs,
            "seconds": self.seconds,
            "most": dict(self.most),
            "picture": self.picture,
            "road_users": {name: dict(counts) for name, counts in self.categories.items()},
        }


def summed(rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Statistics of several recordings together; of sizes the most that one has."""
    seconds, most = 0.0, dict[str, int]()
    categories: dict[str, dict[str, Any]] = {}
    for row in rows:
        seconds += row["seconds"]
        most |= {name: max(size, most.get(name, 0)) for name, size in row["most"].items()}
        for name, counts in row["categories"].items():
            whole = categories.setdefault(
                name, {"tracks": 0, "seconds": 0.0, "metres": 0.0, "speeds": []}
            )
            for key in ("tracks", "seconds", "metres"):
                whole[key] = round(whole[key] + counts[key], 1)
            whole["speeds"] = _add_counts(whole["speeds"], counts["speeds"])
    order = [str(category) for category in Category]
    return {
        "seconds": round(seconds, 1),
        "most": most,
        "categories": {name: categories[name] for name in order if name in categories},
    }


def _add_counts(one: Sequence[int], other: Sequence[int]) -> list[int]:
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    return [count + (shorter[k] if k < len(shorter) else 0) for k, count in enumerate(longer)]


@dataclass(frozen=True, slots=True)
class DatasetFacts:
    """What the card says.

    Attributes
    ----------
    maps
        With their splits, in the order of their names.
    versions
        Of odscen and SUMO.
    table
        Runs that are in it, with ``split``.
    left_out
        How many runs are not, by reason.
    files
        Bytes and SHA-256 of each file, by path.
    """

    plan: DatasetPlan
    maps: tuple[MapFacts, ...]
    versions: Mapping[str, str]
    table: pl.DataFrame
    left_out: Mapping[str, int]
    files: Mapping[str, tuple[int, str]]

    def splits(self) -> list[dict[str, Any]]:
        """A row for each split: maps, runs, and means of figures."""
        import polars as pl

        rows = []
        for split in self.plan.splits:
            own = self.table.filter(pl.col("split") == split)
            row: dict[str, Any] = {"split": split, "maps": own["map"].n_unique()}
            row |= {"scenarios": own["scenario"].n_unique(), "runs": own.height}
            for name in STATISTICS:
                value: Any = own[name].mean()
                row[name] = None if value is None else round(float(value), 4)
            rows.append(row)
        return rows

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready, without a clock: the same dataset gives the same bytes."""
        return {
            "format": "odscen-dataset",
            "version": 1,
            "name": self.plan.name,
            "licence": self.plan.licence,
            "versions": dict(self.versions),
            "maps": [map_facts.to_dict() for map_facts in self.maps],
            "splits": self.splits(),
            "left_out": dict(self.left_out),
            "plan": self.plan.model_dump(mode="json"),
            "files": [
                {"path": path, "bytes": size, "sha256": sha256}
                for path, (size, sha256) in self.files.items()
            ],
        }


def card_text(facts: DatasetFacts) -> str:
    """The card in Markdown."""
    plan, total = facts.plan, facts.table.height
    size = sum(size for size, _ in facts.files.values())
    parts = [
        _front_matter(facts),
        f"# {plan.name}\n",
        f"{plan.description}\n" if plan.description else "",
        f"{total:,} recordings of simulated traffic on {len(facts.maps)} maps, "
        f"{size / 1e6:,.1f} MB, made by odscen {facts.versions['odscen']} with SUMO "
        f"{facts.versions['sumo']}. Licence: {plan.licence}.\n",
        f"At most {plan.shard} runs in a shard. Splits are by town: no map is in two of them.\n",
        "## Splits\n",
        _markdown_table(
            ["split", "maps", "scenarios", "runs", *STATISTICS],
            [list(row.values()) for row in facts.splits()],
        ),
        "Figures are means over runs; units as in the figures of odscen "
        "(mean_speed m/s, mean_delay s).\n",
        "## Formats\n",
        _describe_formats(facts),
        "## Road users\n",
        _road_users(facts),
        "## Maps\n",
        _describe_maps(facts),
        "## How it was made\n",
        _describe_making(plan),
        "## What was left out\n",
        _left_out(facts),
        "The same plan, maps and versions give the same files; `dataset.json` has the plan and "
        "the checksum of each file, `runs.parquet` the figures of each run.",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _front_matter(facts: DatasetFacts) -> str:
    """What Hugging Face's datasets reads: which files are which split, in YAML."""
    plan = facts.plan
    if HUGGINGFACE not in plan.formats:
        return ""
    splits = [split for split in plan.splits if (facts.table["split"] == split).any()]
    lines = [
        "---",
        f"pretty_name: {json.dumps(plan.name)}",
        "license: other",
        f"license_name: {json.dumps(plan.licence)}",
        "configs:",
    ]
    for name, files in (("runs", "shard-*.parquet"), ("maps", "maps/*.parquet")):
        lines += [f"- config_name: {name}", *(["  default: true"] if name == "runs" else [])]
        lines += ["  data_files:"]
        for split in splits:
            path = f"{split}/{HUGGINGFACE}/{files}"
            lines += [f"  - split: {split_word(split)}", f"    path: {json.dumps(path)}"]
    return "\n".join([*lines, "---", ""])


def _describe_formats(facts: DatasetFacts) -> str:
    """Bytes of each format for a run, and where its map is."""
    rows, total = [], max(facts.table.height, 1)
    for form in facts.plan.formats:
        sizes = {
            name: size for name, (size, _) in facts.files.items() if name.split("/")[1:2] == [form]
        }
        maps = sum(size for name, size in sizes.items() if "maps" in name.split("/")[2:-1])
        kilobytes = f"{sum(sizes.values()) / total / 1000:,.0f}"
        where = "in each file" if form in _WHOLE_MAP else f"once, {maps / 1e6:,.1f} MB together"
        rows.append([form, kilobytes, where])
    return _markdown_table(["format", "kB a run, all included", "map"], rows)


def _road_users(facts: DatasetFacts) -> str:
    rows: list[list[object]] = []
    for split in facts.plan.splits:
        own = [map_facts for map_facts in facts.maps if map_facts.split == split]
        whole = summed(
            {
                "seconds": map_facts.seconds,
                "most": map_facts.most,
                "categories": map_facts.categories,
            }
            for map_facts in own
        )
        rows += [
            [split, name, *_describe_tracks([counts])]
            for name, counts in whole["categories"].items()
        ]
    heads = ["split", "category", *_OF_TRACKS]
    return (
        _markdown_table(heads, rows) + "\nSpeeds are of all states; the middle and the upper one "
        f"are exact to {SPEED_STEP:g} m/s. Below 0.1 m/s they have stopped.\n"
    )


_OF_TRACKS: Final = (
    "road users", "hours", "km", "mean m/s", "middle m/s", "95 % below m/s", "stopped %",
)  # fmt: skip


def _describe_tracks(parts: Sequence[Mapping[str, Any]]) -> list[object]:
    """Numbers of the columns :data:`_OF_TRACKS`."""
    seconds, metres = (sum(part[key] for part in parts) for key in ("seconds", "metres"))
    counts: list[int] = []
    for part in parts:
        counts = _add_counts(counts, part["speeds"])
    states = np.array(counts, dtype=np.float64)
    if not states.sum():
        return [sum(part["tracks"] for part in parts), 0, 0, None, None, None, None]
    return [
        f"{sum(part['tracks'] for part in parts):,}",
        f"{seconds / 3600:,.2f}",
        f"{metres / 1000:,.1f}",
        f"{metres / seconds:.1f}",
        f"{_find_quantile(states, 0.5):.1f}",
        f"{_find_quantile(states, 0.95):.1f}",
        f"{100 * states[0] / states.sum():.0f}",
    ]


def _find_quantile(states: FloatArray, share: float) -> float:
    """Speed that a share of the states is not above, m/s."""
    return float(np.searchsorted(np.cumsum(states), share * states.sum())) * SPEED_STEP


def _describe_maps(facts: DatasetFacts) -> str:
    heads = ["map", "split", "runs", "seconds", "lanes with a light", *_OF_TRACKS]
    rows = [
        [
            *(
                map_facts.name,
                map_facts.split,
                map_facts.runs,
                f"{map_facts.seconds:,.0f}",
                map_facts.most.get("lights", 0),
            ),
            *_describe_tracks(list(map_facts.categories.values())),
            map_facts.sha256,
        ]
        for map_facts in facts.maps
    ]
    shown = [
        f"![{_markdown_cell(map_facts.name)}]({map_facts.picture})\n"
        for map_facts in facts.maps
        if map_facts.picture
    ]
    return "\n".join([_markdown_table([*heads, "sha256 of the .xodr"], rows), *shown])


def _describe_making(plan: DatasetPlan) -> str:
    study = plan.study
    seeds = f"{len(study.seeds)} seeds ({study.seeds[0]} to {study.seeds[-1]}) of each scenario"
    sampled = [
        f"- {sampling.count} sampled scenarios on each map of {', '.join(sampling.maps)}, "
        f"seeds from {sampling.seed} on"
        for sampling in study.sample
    ]
    files = [f"- scenarios {', '.join(study.scenarios)}"] if study.scenarios else []
    variants = [f"- variants {', '.join(study.variant_names)}"] if study.variant else []
    return "\n".join([*sampled, *files, *variants, f"- {seeds}"]) + "\n"


def _left_out(facts: DatasetFacts) -> str:
    if not facts.left_out:
        return "Nothing.\n"
    rows = [[count, words] for words, count in facts.left_out.items()]
    return _markdown_table(["runs", "why"], rows)


def _markdown_table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(map(_markdown_cell, line))} |\n" for line in lines)


def _markdown_cell(value: object) -> str:
    text = "-" if value is None else str(value)
    return text.replace("|", "\\|").replace("\n", " ")
