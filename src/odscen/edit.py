"""Edits of scenarios: :class:`Editing` with undo, and pure functions.

A function takes a scenario and gives the changed one; those that look at the map take its graph,
``workspace.map(NAME).graph()``. What a rule forbids is refused, and nothing has changed then.

>>> from odscen import edit
>>> scenario = edit.new_scenario(graph, name="first", roi=["r12"])
>>> scenario = edit.add_actor(scenario, graph, category=edit.Category.CAR, spawn="12.0.-1.14")
"""

from odscen.app.editing import Editing, EditStep
from odscen.app.variants import make_variant, read_edits
from odscen.base.categories import Category
from odscen.scenario import edits
from odscen.scenario.edits import *  # noqa: F403  # each edit that it lists

__all__ = ["Category", "EditStep", "Editing", "make_variant", "read_edits"]
__all__ += edits.__all__
