"""A run watched step by step, from the caller's own loop.

SUMO runs in its own process as always, and a thread of ours follows it: it hands each step to the
caller and waits there until the next one is asked for, so that nothing piles up.
"""

from __future__ import annotations

import queue
import threading
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from odscen.app.running.runs import carry_out, check_given, prepare_run
from odscen.base.categories import Category
from odscen.base.errors import ConflictError
from odscen.runs.new_run import refuse_finished_run
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.checks.rule_checks import rule_problems
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.rules.story_files import story_plan
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.app.running.runs import CheckedRun
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.in_step import Step

_PROGRAM = "program"
"""Who switches lights in the events of a run, if no actor does."""
_LISTEN = 0.2
"""Wall seconds after which a wait looks for Ctrl-C, see ``run_jobs``."""


class WatchedRun:
    """A run that waits for whoever watches it: an iterator of its steps, see :func:`watch`.

    Parameters
    ----------
    checked
        The run, from :func:`odscen.app.running.runs.check_run`; it starts at once and waits.

    Raises
    ------
    ScenarioError
        If a spawn or goal is not usable in SUMO.
    """

    def __init__(self, checked: CheckedRun) -> None:
        self._checked = checked
        self._prepared = prepare_run(checked)
        self._map = checked.map
        ground = ElevationLookup(self._map.sumo.graph, checked.entry.lane_table())
        self._in_step = InStep(self._prepared.plan, ground, self._hand_over, rules=True)
        self._rules = list(checked.scenario.rules)
        self._others = {actor.id: Category(actor.category) for actor in self._prepared.plan.actors}
        self._steps: queue.SimpleQueue[Step | None] = queue.SimpleQueue()
        self._wanted = threading.Semaphore(0)
        self._closing = self._over = self._handed = False
        self._run: Run | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._follow_run, name="odscen-watch", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[Step]:
        return self

    def __next__(self) -> Step:
        """Let SUMO make its next step."""
        if self._over:
            raise StopIteration
        if self._handed:
            self._wanted.release()
        step = self._wait_for_step()
        self._handed = step is not None
        if step is None:
            self._over = True
            self._refuse_error()
            raise StopIteration
        return step

    @property
    def run(self) -> Run:
        """The finished run, as :func:`odscen.app.running.runs.run` gives it.

        Raises
        ------
        ConflictError
            If it has not ended.
        """
        if self._run is None:
            raise ConflictError(
                "the run has not ended; it ends with its last step, or with the block of watch"
            )
        return self._run

    def act(self, actor: str, **action: Any) -> None:
        """Let an actor do something from this step on, as a rule of the scenario would.

        Parameters
        ----------
        actor
            Its id, as in the ids of steps: of the scenario, of a flow or of demand.
        **action
            One kind of action with its fields: ``brake={"by": 6}``; several run together.

        Raises
        ------
        ScenarioError
            If there is no such actor or action, or it is not possible for it.
        ConflictError
            If no step is being looked at.
        """
        self._give_rule(self._acting_rule(actor, action), self._others)

    def switch_light(
        self,
        light: str,
        movement: str | None = None,
        *,
        shows: Literal["green", "off", "program"] = "green",
    ) -> None:
        """Switch a traffic light with the next step; who is on the road does not matter.

        Parameters
        ----------
        light
            Its junction, as in signal programs.
        movement
            What gets green, ``r1>r2`` or ``walk r1``: the program jumps to the stage in which that
            has green, and resumes from there. Only for ``green``, and necessary for it.
        shows
            ``off`` is right of way as without lights, ``program`` the program that ran before.

        Raises
        ------
        ScenarioError
            If the map has no such light, or the light no such movement.
        ConflictError
            If no step is being looked at.
        """
        asked = {"light": light, "shows": shows}
        part = asked if movement is None else asked | {"movement": movement}
        self._give_rule(self._acting_rule(_PROGRAM, {"signal": part}), {_PROGRAM: Category.CAR})

    def add_rule(self, rule: Mapping[str, Any]) -> None:
        """Add a rule, as in the scenario document, that holds from this step on.

        Raises
        ------
        ScenarioError
            If something is wrong with it, in words.
        ConflictError
            If no step is being looked at.
        """
        self._give_rule(rule, self._others)

    def close(self) -> None:
        """Stop after the present step, and wait until results and report are written.

        Raises
        ------
        WorkspaceError
            If they could not be.
        """
        self._closing = True
        self._wanted.release()
        while self._thread.is_alive():
            self._thread.join(_LISTEN)
        if not self._over:
            self._over = True
            self._refuse_error()

    def _acting_rule(self, actor: str, action: Mapping[str, Any]) -> dict[str, Any]:
        """Make the rule by which somebody does something at once."""
        together = [{kind: part} for kind, part in action.items()]
        then = together[0] if len(together) == 1 else {"together": together}
        name = f"act-{len(self._rules) + 1}"
        return {"id": name, "actor": actor, "when": {"time": {"after": 0}}, "then": [then]}

    def _give_rule(self, rule: Mapping[str, Any], others: Mapping[str, Category]) -> None:
        if not self._handed or self._over:
            raise ConflictError("rules are given while a step is looked at, inside the loop")
        made = validated(StoryRule, rule)
        known, on = self._checked.scenario, self._map
        index = len(self._rules)
        whole = known.model_copy(update={"rules": (*self._rules, made)})
        region = Region.of(on.sumo.graph, known.roi)
        refuse_errors(rule_problems(whole, region, on.lights, only=index, others=others))
        alone = known.model_copy(update={"rules": (made,)})
        self._in_step.add_rules(story_plan(alone, on.sumo).to_json())
        self._rules.append(made)

    def _wait_for_step(self) -> Step | None:
        while True:
            try:
                return self._steps.get(timeout=_LISTEN)
            except queue.Empty:
                continue

    def _refuse_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _hand_over(self, step: Step) -> None:
        self._steps.put(step)
        self._wanted.acquire()
        if self._closing:
            self._in_step.stop()

    def _follow_run(self) -> None:
        try:
            self._run = carry_out(self._checked, self._prepared, live=self._in_step)
        except BaseException as error:  # raised again where the steps are asked for
            self._error = error
        finally:
            self._steps.put(None)


@contextmanager
def watch(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    settings: RunSettings = AS_DESIGNED,
    name: str | None = None,
    out: GivenPath | None = None,
    overwrite: bool = False,
) -> Iterator[WatchedRun]:
    """Run a scenario, see every step of it, and act in it; SUMO waits for the loop.

    Leaving the block early, by ``break`` or by an error, stops the run; what happened until then is
    written like the results of any run.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    settings
        How it is run; always in one piece.
    name
        Of the run's folder; the scenario's if not given.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    overwrite
        Whether a run that has ended is replaced in ``out``; in the workspace's ``runs`` it is.

    Yields
    ------
    WatchedRun
        Iterate over it for the steps, each a :class:`~odscen.sumo.runner.in_step.Step`: ``time``
        (s) and arrays of shape ``(N,)`` of the road users under way, ``ids``, ``x``, ``y``, ``z``
        (m), ``hdg``, ``pitch`` (rad) of body centres in the OpenDRIVE frame, ``speed`` (m/s). When
        the block has ended, ``run`` is the finished run. ``act`` and ``add_rule`` of the run let
        road users do what rules can say, from the step that is looked at on, and ``switch_light``
        switches a traffic light.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    NotFoundError
        If the workspace does not have its map.
    ConflictError
        If a run that has not ended is in the folder, or one that has and is not to be replaced.
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.

    Examples
    --------
    >>> with watch(workspace, scenario) as steps:
    ...     for step in steps:
    ...         if step.time > 60 and (step.speed < 0.1).all():
    ...             break
    ...         if step.time == 30:
    ...             steps.act("van", brake={"by": 6, "hold": 2})
    >>> steps.run.status
    """
    settings = replace(settings, slice_length=None)
    checked = check_given(workspace, scenario, name=name, out=out, settings=settings)
    if out is not None and not overwrite:
        refuse_finished_run(checked.folder)
    watched = WatchedRun(checked)
    try:
        yield watched
    finally:
        watched.close()
