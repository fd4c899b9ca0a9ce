"""scipy's searches of graphs, imported without what of numpy and scipy they never use."""

from __future__ import annotations

from odscen.base.late_modules import function_when_used, import_when_used

import_when_used("numpy.ctypeslib", "numpy.f2py", "numpy.ma", "numpy.polynomial", "numpy.testing")
function_when_used("scipy.sparse.csgraph._laplacian", "laplacian")
from scipy.sparse import csgraph  # noqa: E402 - which names these

__all__ = ["csgraph"]
