"""The sentences that the server makes, for the catalogue: templates read from its source.

The page matches what the server sends with these, see ``frontend/src/language/sentences.ts``;
so no sentence needs an id, and files and the command line keep theirs. What a sentence is, says
:mod:`tools.sentence_templates`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticKnownError

from odscen.base.categories import Category
from tools.sentence_templates import templates_of, templates_of_text

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1] / "src/odscen"
TARGET = Path(__file__).parents[1] / "frontend/src/language/serverSentences.ts"

SHOWN = (
    "app/",
    "base/",
    "carla/mirror/",
    "carla/served/",
    "carla/server/",
    "esmini/",
    "metadrive/metadrive_run",
    "convert/",
    "formats/__init__",
    "formats/base",
    "experiments/ineffective",
    "experiments/journal",
    "experiments/plan",
    "experiments/search",
    "experiments/studies",
    "experiments/sweep",
    "experiments/table",
    "experiments/work",
    "formats/openscenario",
    "formats/tll_",
    "lanegraph/",
    "learning/fill",
    "learning/offered_options",
    "opendrive/",
    "figures/by_place/analysis_times",
    "figures/judging/",
    "figures/measures/usability",
    "figures/measures/traffic_files",
    "records/",
    "runs/",
    "reports/signal_pictures",
    "scenario/",
    "simulators/",
    "sumo/",
    "web/",
    "maps/",
)
"""Where the page's sentences come from; the rest is for the command line, reports and files."""
HIDDEN = (
    "app/demand/transit_feeds",
    "app/differences",
    "app/doctor",
    "app/editing",
    "app/environments",
    "app/learned/",
    "app/map_comparison",
    "app/map_repairs",
    "app/running/reports",
    "app/running/run_repairs",
    "experiments/sweep_page",
    "app/variants",
    "base/given_arrays",
    "carla/server/protocol",
    "carla/server/probe",
    "carla/server/releases",
    "convert/imported/netconvert_recipe",
    "convert/imported/network_changes",
    "convert/model/net.",
    "convert/verify/",
    "lanegraph/columns",
    "lanegraph/graph_npz",
    "lanegraph/map_graphml",
    "scenario/document/driver_parameters",
    "scenario/forms/array_reading",
    "scenario/sampling/generation_settings",
    "scenario/sampling/sampler",
    "sumo/outputs/corridor_traces",
    "sumo/realize/sumo_tools",
    "sumo/worker/behaviour/",
    "sumo/worker/fork_server",
    "web/entry_pages",
    "web/http_server",
    "maps/map_pictures",
    "maps/shipped",
    "maps/traffic_losses",
)

# Pydantic's findings that a document or a request can have, with what they need to be made.
_FINDINGS: dict[Any, dict[str, Any] | None] = {
    "bool_parsing": None,
    "bool_type": None,
    "dict_type": None,
    "enum": {"expected": ""},
    "extra_forbidden": None,
    "finite_number": None,
    "float_parsing": None,
    "float_type": None,
    "greater_than": {"gt": 0},
    "greater_than_equal": {"ge": 0},
    "int_from_float": None,
    "int_parsing": None,
    "int_type": None,
    "json_invalid": {"error": ""},
    "less_than": {"lt": 0},
    "less_than_equal": {"le": 0},
    "list_type": None,
    "literal_error": {"expected": ""},
    "missing": None,
    "model_attributes_type": None,
    "model_type": {"class_name": ""},
    "string_pattern_mismatch": {"pattern": ""},
    "string_too_long": {"max_length": 1},
    "string_too_short": {"min_length": 1},
    "string_type": None,
    "too_long": {"field_type": "", "max_length": 1, "actual_length": 2},
    "too_short": {"field_type": "", "min_length": 1, "actual_length": 0},
    "tuple_type": None,
    "union_tag_invalid": {"discriminator": "", "tag": "", "expected_tags": ""},
    "union_tag_not_found": {"discriminator": ""},
    "value_error": {"error": ""},
}

_HEAD = """\
// Written by `make api` from the source of the server.
import type { MessageDescriptor } from "@lingui/core";
import { msg } from "@lingui/core/macro";

/** Sentences that the server makes; in braces is what it inserts. */
export const SERVER_SENTENCES: readonly MessageDescriptor[] = [
"""


def server_sentences() -> str:
    """The module of the page; the same source gives the same text."""
    lines = [f"  msg({{ message: {json.dumps(one, ensure_ascii=False)} }}),\n" for one in _all()]
    return f"{_HEAD}{''.join(lines)}];\n"


def _all() -> list[str]:
    """All templates, each form once."""
    known: dict[str, str] = {}
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if name.startswith(SHOWN) and not name.startswith(HIDDEN):
            for form, template in templates_of(path.read_text(encoding="utf-8")):
                known.setdefault(form, template)
    for text in (*_validation_texts(), *Category, "figure"):  # single words that stand in sentences
        for form, template in templates_of_text(text):
            known.setdefault(form, template)
    return sorted(known.values())


def _validation_texts() -> Iterator[str]:
    for kind, context in _FINDINGS.items():
        text = PydanticKnownError(kind, context).message_template
        for plural in ("", "s") if "{expected_plural}" in text else ("",):
            yield text.replace("{expected_plural}", plural)
