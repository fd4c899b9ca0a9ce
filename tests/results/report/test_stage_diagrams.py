"""Pictures of a signal program: the real light of the guide on the shipped crossing."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import pytest
from lxml import etree

from odscen.drawing.map_drawing import MapDrawing
from odscen.drawing.map_shapes import draw_map
from odscen.opendrive.parse import parse
from odscen.results.records.light_programs import stage_spans
from odscen.results.report.signal_charts import phase_spans
from odscen.results.report.signal_sheet import signal_sheet
from odscen.results.report.stage_diagrams import JunctionPictures
from odscen.sumo.realize.light_realization import realized_lights
from tests.signal_case import MAP, crossing, program, scenario

if TYPE_CHECKING:
    from odscen.results.records.light_programs import LightProgram
