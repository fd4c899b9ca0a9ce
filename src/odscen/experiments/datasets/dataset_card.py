"""The card of a dataset: what is in it, what it was made of, and what was left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.experiments.datasets.dataset_plan import DatasetPlan

STATISTICS = ("planned", "arrived", "collided", "mean_speed", "mean_delay")
"""Figures of runs that the card gives the mean of."""


@dataclass(frozen=True, slots=True)
class DatasetFacts:
    """What the card says.

    Attributes
    ----------
    maps
        SHA-256 of the .xodr and split, by name.
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
    maps: Mapping[str, tuple[str, str]]
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
            "maps": [
                {"name": name, "sha256": sha256, "split": split}
                for name, (sha256, split) in self.maps.items()
            ],
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
        f"# {plan.name}\n",
        f"{plan.description}\n" if plan.description else "",
        f"{total:,} recordings of simulated traffic on {len(facts.maps)} maps, "
        f"{size / 1e6:,.1f} MB, made by odscen {facts.versions['odscen']} with SUMO "
        f"{facts.versions['sumo']}. Licence: {plan.licence}.\n",
        f"Formats: {', '.join(plan.formats)}; at most {plan.shard} runs in a shard. "
        "Splits are by town: no map is in two of them.\n",
        "## Splits\n",
        _table(
            ["split", "maps", "scenarios", "runs", *STATISTICS],
            [list(row.values()) for row in facts.splits()],
        ),
        "Figures are means over runs; units as in the figures of odscen "
        "(mean_speed m/s, mean_delay s).\n",
        "## Maps\n",
        _table(
            ["map", "split", "sha256 of the .xodr"],
            [[name, split, sha256] for name, (sha256, split) in facts.maps.items()],
        ),
        "## How it was made\n",
        _made(plan),
        "## What was left out\n",
        _left_out(facts),
        "The same plan, maps and versions give the same files; `dataset.json` has the plan and "
        "the checksum of each file, `runs.parquet` the figures of each run.",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _made(plan: DatasetPlan) -> str:
    study = plan.study
    seeds = f"{len(study.seeds)} seeds ({study.seeds[0]} to {study.seeds[-1]}) of each scenario"
    sampled = [
        f"- {one.count} sampled scenarios on each map of {', '.join(one.maps)}, seeds from "
        f"{one.seed} on"
        for one in study.sample
    ]
    files = [f"- scenarios {', '.join(study.scenarios)}"] if study.scenarios else []
    variants = [f"- variants {', '.join(study.variant_names)}"] if study.variant else []
    return "\n".join([*sampled, *files, *variants, f"- {seeds}"]) + "\n"


def _left_out(facts: DatasetFacts) -> str:
    if not facts.left_out:
        return "Nothing.\n"
    rows = [[count, words] for words, count in facts.left_out.items()]
    return _table(["runs", "why"], rows)


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(map(_cell, line))} |\n" for line in lines)


def _cell(value: object) -> str:
    text = "-" if value is None else str(value)
    return text.replace("|", "\\|").replace("\n", " ")
