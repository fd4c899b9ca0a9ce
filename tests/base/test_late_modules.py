"""Modules that wait until they are used."""

from __future__ import annotations

import subprocess
import sys


def test_paths_do_not_import_what_builds_fortran_and_it_is_there_when_used() -> None:
    code = (
        "import sys; import odscen.lanegraph.shortest_paths; import numpy as np;"
        "import odscen.lanegraph.searches.graph_searches as s;"
        "print('numpy.f2py.f2py2e' in sys.modules, 'numpy.testing._private' in sys.modules);"
        "np.testing.assert_allclose(1.0, 1.0); from numpy.testing import assert_array_equal;"
        "print('numpy.testing._private' in sys.modules, s.csgraph.__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "True", "scipy.sparse.csgraph"]


def test_paths_do_not_import_linear_algebra_and_the_laplacian_is_there_when_called() -> None:
    code = (
        "import sys; import odscen.lanegraph.shortest_paths; import numpy as np;"
        "import odscen.lanegraph.searches.graph_searches as s;"
        "print('scipy.linalg' in sys.modules);"
        "print(s.csgraph.laplacian(np.array([[0.0, 1.0], [1.0, 0.0]])).tolist());"
        "print('scipy.sparse.linalg' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False", "[[1.0, -1.0], [-1.0, 1.0]]", "True"]


def test_the_tree_of_points_comes_alone_and_the_rest_of_its_package_when_used() -> None:
    code = (
        "import sys; from odscen.base.near_points import cKDTree;"
        "rotation = 'scipy.spatial.transform._rotation';"
        "print(rotation in sys.modules, 'scipy.special' in sys.modules);"
        "print(cKDTree([[0.0, 0.0], [3.0, 4.0]]).query([3.0, 0.0])[0]);"
        "import scipy.spatial; from scipy.spatial.distance import cityblock;"
        "print(cityblock([0, 0], [3, 4]), scipy.spatial.distance.euclidean([0, 0], [3, 4]));"
        "print(scipy.spatial.transform.Rotation.identity().magnitude(), "
        "scipy.spatial.geometric_slerp([1.0, 0.0], [0.0, 1.0], 1.0).round(9).tolist())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False False", "3.0", "7 5.0", "0.0 [0.0, 1.0]"]
