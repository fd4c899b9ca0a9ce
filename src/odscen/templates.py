"""Templates of scenes: what there is, and placing one on a map.

>>> from odscen import templates
>>> [template.name for template in templates.templates()]
>>> scenario = templates.place_template(workspace, "cut-in", "Town04", values={"ttc": 2.0})
"""

from odscen.app.template_scenarios import template_scenario as place_template
from odscen.app.template_scenarios import templates, write_template
from odscen.scenario.templates.scene_template import SceneTemplate

__all__ = ["SceneTemplate", "place_template", "templates", "write_template"]
