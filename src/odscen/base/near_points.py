"""SciPy's tree of points, without the rest of its package.

``scipy.spatial`` names distances, rotations and what is made of both, and with them special
functions: more than half of what it takes to be imported.
"""

from __future__ import annotations

from odscen.base.late_modules import function_when_used, names_when_used

function_when_used("scipy.spatial._geometric_slerp", "geometric_slerp")
function_when_used("scipy.spatial._procrustes", "procrustes")
names_when_used("scipy.spatial.distance", "scipy.spatial.transform")
from scipy.spatial import cKDTree  # noqa: E402 - which names these

__all__ = ["cKDTree"]
