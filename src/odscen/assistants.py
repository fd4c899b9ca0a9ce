"""A tool server for assistants: the Model Context Protocol over standard input and output.

``odscen assist`` starts it; it needs ``pip install 'odscen[assist]'``. Tools take names of the
workspace, never paths: nothing outside of it is read or written. Answers are small, and name what
they are about; edits are those of the page, with its checks and its undo.
"""

from __future__ import annotations

import functools
import json
from typing import TYPE_CHECKING, Any

from odscen.app.editing import Editing
from odscen.app.generation import generate
from odscen.app.running.runs import run as run_one
from odscen.app.scenarios import SUFFIX, check_scenario, read_scenario, write_scenario
from odscen.app.template_scenarios import template_scenario, templates
from odscen.base.errors import InputError, MissingDependencyError, NotFoundError, OdscenError
from odscen.experiments.sweeps import SweepSettings, sweep
from odscen.figures.judging.expectations import evaluate, parse_expectation
from odscen.maps.folder_names import check_name
from odscen.maps.shipped import shipped_maps
from odscen.runs.finished_run import Run
from odscen.runs.judged import read_judged
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.scenario.sweeps.sweep_plan import Range, SweepPlan

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from mcp.server.mcpserver import MCPServer

    from odscen.drawing.map_sheet import Picture
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace

MOST_ROWS = 30
"""Of a list in an answer."""
MOST_CASES = 50
"""Of one variation."""
LONGEST = 3600.0
"""Simulated seconds of a run."""
PATIENCE = 600.0
"""Wall seconds of a run."""
_SHOWN = ("planned", "arrived", "collided", "teleported", "mean_delay", "mean_speed", "min_ttc")
_TELLING = (
    "collision",
    "teleport_start",
    "emergency_stop",
    "jam_begin",
    "rule_started",
    "rule_acted",
    "rule_failed",
)
_GUIDE = (
    "odscen makes traffic scenarios on OpenDRIVE maps and runs them in SUMO. Find a map, place a "
    "template or sample a scenario, change it by edits (list_edits says which, and what each "
    "takes), run it, judge it with expectations such as 'min_ttc >= 1.5 s', and explain it. "
    "Metres, seconds, m/s. All names are of the workspace."
)


class Tools:
    """What assistants can do in a workspace; each public method is a tool.

    Parameters
    ----------
    workspace
        Has maps, scenarios and runs; nothing else is looked at.
    """

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace

    def find_maps(self, words: str = "") -> dict[str, Any]:
        """List maps of the workspace whose name has the words, and those that ship."""
        there = [self._describe_map(entry) for entry in self._workspace.maps()]
        known = {row["map"] for row in there}
        more = [file.stem for file in shipped_maps() if file.stem not in known]
        wanted = words.lower().split()
        return {
            "maps": [row for row in there if all(word in row["map"].lower() for word in wanted)][
                :MOST_ROWS
            ],
            "shipped_maps_to_add": [
                name for name in more if all(word in name.lower() for word in wanted)
            ],
        }

    def add_shipped_map(self, map_name: str) -> dict[str, Any]:
        """Add a map that ships to the workspace."""
        files = {file.stem: file for file in shipped_maps()}
        if map_name not in files:
            raise NotFoundError("map that ships", map_name, sorted(files))
        return self._describe_map(self._workspace.add_map(files[map_name]))

    def list_templates(self) -> dict[str, Any]:
        """List scenes that can be placed on maps, with their numbers and the ranges of these."""
        return {
            "templates": [
                {
                    "template": template.name,
                    "summary": template.summary,
                    "needs": template.needs,
                    "values": {
                        number.name: f"{number.meaning}; {number.low:g} to {number.high:g} "
                        f"{number.unit}"
                        for number in template.parameters
                    },
                }
                for template in templates()
            ]
        }

    def place_template(
        self, template: str, map_name: str, name: str, values: dict[str, float] | None = None
    ) -> dict[str, Any]:
        """Make a scenario of a template on a map, under a new name."""
        made = template_scenario(
            self._workspace, template, check_name(map_name), values=values, name=name
        )
        return self._store_new(made, name)

    def sample_scenario(
        self, map_name: str, name: str, seed: int = 0, fill: float = 0.2
    ) -> dict[str, Any]:
        """Make a scenario of random traffic on a map; fill is a share of what fits, 0 to 1."""
        settings = GenerationSettings(map_name=check_name(map_name), seed=seed, fill=fill)
        file = self._new_file(name)
        (made,) = generate(self._workspace, settings=settings, out=self._workspace.root / "sampled")
        scenario = read_scenario(made)
        made.unlink()
        write_scenario(scenario.model_copy(update={"name": name}), file)
        return self.show_scenario(name)

    def show_scenario(self, scenario: str) -> dict[str, Any]:
        """Show what a scenario is: road users, rules, parameters, problems, steps to undo."""
        file = self._file_of(scenario)
        document = read_scenario(file)
        problems = check_scenario(self._workspace, document)
        return {
            "scenario": scenario,
            "map": document.map.name,
            "seed": document.seed,
            "duration": document.simulation.duration,
            "actors": [
                {"id": actor.id, "category": str(actor.category), "ego": actor.ego}
                for actor in document.actors[:MOST_ROWS]
            ],
            "count_of_actors": len(document.actors),
            "flows": len(document.flows),
            "rules": [
                json.loads(rule.model_dump_json(exclude_defaults=True))
                for rule in document.rules[:MOST_ROWS]
            ],
            "parameters": {key: parameter.value for key, parameter in document.parameters.items()},
            "formulas": dict(document.formulas),
            "problems": [str(problem) for problem in problems[:MOST_ROWS]],
            "undo": Editing(self._workspace, file).undo_label,
        }

    def list_edits(self, kind: str = "") -> dict[str, Any]:
        """List the kinds of edits; of a kind, its arguments as JSON Schema."""
        if not kind:
            return {"edits": Editing.kinds()}
        return {"kind": kind, "arguments": Editing.arguments(kind)}

    def edit_scenario(
        self, scenario: str, edits: list[dict[str, Any]], label: str = ""
    ) -> dict[str, Any]:
        """Make edits, all or none, as one step of undo; each has kind and its arguments."""
        editing = Editing(self._workspace, self._file_of(scenario))
        editing.apply_all(edits, label=label or None)
        editing.save()
        return self.show_scenario(scenario)

    def undo_edit(self, scenario: str) -> dict[str, Any]:
        """Take back the last step of a scenario."""
        editing = Editing(self._workspace, self._file_of(scenario))
        editing.undo()
        editing.save()
        return self.show_scenario(scenario)

    def run_scenario(
        self,
        scenario: str,
        run: str,
        until: float | None = None,
        seed: int | None = None,
        expect: list[str] | None = None,
    ) -> dict[str, Any]:
        """Run a scenario under a name, and judge it by expectations such as 'min_ttc >= 1.5 s'."""
        file, name = self._file_of(scenario), check_name(run, what="run")
        longest = read_scenario(file).simulation.duration if until is None else until
        if longest > LONGEST:
            raise InputError(f"a run here lasts at most {LONGEST:g} s, not {longest:g}; give until")
        settings = RunSettings(
            until=until,
            seed=seed,
            time_limit=PATIENCE,
            expectations=tuple(parse_expectation(text) for text in expect or ()),
        )
        ended = run_one(self._workspace, file, settings=settings, name=name)
        return _describe_run(ended)

    def judge_run(self, run: str, expect: list[str]) -> dict[str, Any]:
        """Hold a run that has ended against expectations."""
        ended = self._run_of(run)
        verdicts = evaluate(
            [parse_expectation(text) for text in expect], ended.summary, read_judged(ended.folder)
        )
        return {
            "run": run,
            "verdicts": [
                {"expectation": row.expectation, "value": row.value, "passed": row.passed}
                for row in verdicts
            ],
        }

    def explain_run(self, run: str) -> dict[str, Any]:
        """Say what became of a run and why: usability, events, junctions with most delay."""
        ended = self._run_of(run)
        events = ended.events()
        telling = events.filter(events["kind"].is_in(list(_TELLING))).head(MOST_ROWS)
        junctions = ended.figures_by("junction")
        worst = junctions.sort("delay", descending=True, nulls_last=True).head(3)
        return {
            **_describe_run(ended),
            "reasons": [str(reason) for reason in ended.usability.get("reasons", ())][:MOST_ROWS],
            "events": [
                {key: row[key] for key in ("time", "kind", "actor", "partner", "rule", "detail")}
                for row in telling.iter_rows(named=True)
            ],
            "worst_junctions": worst.select("junction", "vehicles", "delay").to_dicts(),
        }

    def vary_scenario(
        self,
        scenario: str,
        name: str,
        parameter: str,
        low: float,
        high: float,
        steps: int = 5,
        safe: list[str] | None = None,
    ) -> dict[str, Any]:
        """Run a scenario with values of a parameter of it; say which cases are not safe.

        Not safe is a collision, or a limit of `safe` that is broken, such as 'min_ttc >= 1.5'.
        """
        if not 2 <= steps <= MOST_CASES:
            raise InputError(f"steps must lie between 2 and {MOST_CASES}, not {steps}")
        document = read_scenario(self._file_of(scenario))
        plan = SweepPlan((Range(parameter, low, high, steps=steps),))
        out = self._workspace.sweeps / check_name(name, what="sweep")
        table = sweep(
            self._workspace, document, plan, out, settings=SweepSettings(safe=tuple(safe or ()))
        ).table
        kept = [key for key in ("case", parameter, "safe", *_SHOWN) if key in table.columns]
        rows = table.select(kept).to_dicts()
        return {
            "sweep": name,
            "cases": rows,
            "not_safe": [row[parameter] for row in rows if row["safe"] is False],
        }

    def _describe_map(self, entry: MapEntry) -> dict[str, Any]:
        figures = entry.statistics()
        return {
            "map": entry.name,
            "lane_metres": round(figures.driving_lane_length),
            "junctions": figures.junctions,
            "traffic_lights": figures.traffic_lights,
            "crosswalks": figures.crosswalks,
        }

    def _new_file(self, name: str) -> Path:
        file = self._workspace.scenarios / f"{check_name(name, what='scenario')}{SUFFIX}"
        if file.exists():
            raise InputError(f"there is a scenario {name!r} already; name another one")
        return file

    def _store_new(self, scenario: Scenario, name: str) -> dict[str, Any]:
        write_scenario(scenario, self._new_file(name))
        return self.show_scenario(name)

    def _file_of(self, scenario: str) -> Path:
        file = self._workspace.scenarios / f"{check_name(scenario, what='scenario')}{SUFFIX}"
        if not file.is_file():
            known = sorted(
                path.name.removesuffix(SUFFIX)
                for path in self._workspace.scenarios.glob(f"*{SUFFIX}")
            )
            raise NotFoundError("scenario", scenario, known)
        return file

    def _run_of(self, run: str) -> Run:
        folder = self._workspace.runs / check_name(run, what="run")
        if not folder.is_dir():
            raise NotFoundError(
                "run", run, sorted(path.name for path in self._workspace.runs.glob("*"))
            )
        return Run.open(folder)

    def picture_of_map(self, map_name: str) -> Picture:
        """Draw a map."""
        return self._workspace.map(check_name(map_name)).plot()

    def picture_of_run(self, run: str) -> Picture:
        """Draw the mean speed by place of a run, on its map."""
        ended = self._run_of(run)
        scenario = read_scenario(ended.folder / "scenario.json")
        entry = self._workspace.map_for(scenario.map.name, scenario.map.sha256)
        return ended.plot(entry)


def _describe_run(run: Run) -> dict[str, Any]:
    table = {name: run.summary["figures"].get(name, run.counts.get(name)) for name in _SHOWN}
    return {
        "run": run.folder.name,
        "status": str(run.status),
        "usable": run.usability.get("headline", ""),
        "figures": {name: value for name, value in table.items() if value is not None},
        "verdicts": [
            {key: row[key] for key in ("expectation", "value", "passed")}
            for row in run.known["expectations"]
        ],
    }


def make_server(workspace: Workspace) -> MCPServer:
    """Make the server of a workspace; ``run()`` serves on standard input and output.

    Raises
    ------
    MissingDependencyError
        Without the SDK.
    """
    try:
        from mcp.server.mcpserver import Image, MCPServer
        from mcp.server.mcpserver.exceptions import ToolError
    except ImportError as error:
        raise MissingDependencyError(
            "a server for assistants needs the package mcp: pip install 'odscen[assist]'"
        ) from error

    def in_words(function: Callable[..., Any]) -> Callable[..., Any]:
        """Let what odscen refuses reach the assistant in odscen's words."""

        @functools.wraps(function)
        def told(*arguments: Any, **fields: Any) -> Any:
            try:
                return function(*arguments, **fields)
            except OdscenError as error:
                raise ToolError(str(error)) from error

        return told

    tools = Tools(workspace)
    server = MCPServer("odscen", instructions=_GUIDE)
    for name in vars(Tools):
        if not name.startswith(("_", "picture")):
            server.tool()(in_words(getattr(tools, name)))

    def show(picture: Picture) -> Any:
        from odscen.drawing.map_sheet import svg_to_png

        try:
            return Image(data=svg_to_png(picture.svg, width=1000), format="png")
        except MissingDependencyError:
            return picture.svg

    @server.tool(structured_output=False)
    @in_words
    def draw_map(map_name: str) -> Any:
        """Draw a map: a PNG, or SVG text without odscen[png]."""
        return show(tools.picture_of_map(map_name))

    @server.tool(structured_output=False)
    @in_words
    def draw_run(run: str) -> Any:
        """Draw the mean speed by place of a run on its map: a PNG, or SVG text."""
        return show(tools.picture_of_run(run))

    @server.resource("odscen://schemas/scenario", mime_type="application/json")
    def scenario_schema() -> str:
        """Schema of the scenario document."""
        return json.dumps(Scenario.model_json_schema())

    @server.resource("odscen://schemas/edits", mime_type="application/json")
    def edit_schemas() -> str:
        """Arguments of every kind of edit, as JSON Schema."""
        return json.dumps({kind: Editing.arguments(kind) for kind in Editing.kinds()})

    return server
