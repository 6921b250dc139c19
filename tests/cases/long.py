"""What is left to `make long`, which sets ROM_LONG=1, and what of `make test` takes longest."""

import os
from itertools import repeat

import pytest

ROM_LONG = bool(os.environ.get("ROM_LONG"))
# numbers of processes whose results are compared with those of one
SHARED_BY = (2, 3) if ROM_LONG else (2,)
# folders and files marked `once` as a whole
ONCE = """
components faults/test_archive_faults.py fe/mesh/test_mesh_decks.py mbs/elements/test_mbs_laws.py
mbs/equations/test_mbs_cache.py project/test_docs.py
""".split()
# marks of files about small meshes of finite elements, which are warned of
MESHED = [
    pytest.mark.fenicsx,
    pytest.mark.filterwarnings("ignore:Number of integration points"),
    pytest.mark.filterwarnings("ignore::rom.errors.RomWarning"),
]
COARSE = [*MESHED, pytest.mark.once]
# what the light environment has not
ABSENT = ("dolfinx", "gmsh", "h5py", "matplotlib", "meshio", "pyvista")
# files of `make test` that begin, so that no worker is left alone with one of them at the end
LONGEST_FIRST = """
project/test_demos.py faults/test_generated.py mbs/published/test_mbs_crank.py
mbs/analysis/test_mbs_equilibrium.py fe/test_fe_mpi.py faults/test_kills.py
faults/test_geometry_programs.py faults/test_run_kills.py faults/test_planted_modules.py
faults/test_mesh_faults.py reduction/test_compressor_blade.py fe/test_fe_reduction.py
parametric/test_family_fe.py fe/mesh/test_mesh_geometries.py
reduction/test_methods_on_components.py
""".split()


def few(number, cases):
    """Cases of a test, all but the first ones left to `make long`."""
    long = [*repeat([], number), *repeat([pytest.mark.long], len(cases) - number)]
    return [with_marks(case, marks) for case, marks in zip(cases, long, strict=True)]


def with_marks(case, marks):
    if hasattr(case, "marks"):
        return pytest.param(*case.values, marks=[*case.marks, *marks], id=case.id)
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=marks)
