"""What is left to `make long`, which sets ROM_LONG=1, and what of `make test` takes longest."""

import os

ROM_LONG = bool(os.environ.get("ROM_LONG"))
# numbers of processes whose results are compared with those of one
SHARED_BY = (2, 3) if ROM_LONG else (2,)
# files of `make test` that begin, so that no worker is left alone with one of them at the end
LONGEST_FIRST = (
    "project/test_demos.py",
    "faults/test_generated.py",
    "project/test_demos_under_mpi.py",
    "mbs/published/test_mbs_crank.py",
    "mbs/analysis/test_mbs_equilibrium.py",
    "fe/test_fe_body_mpi.py",
    "faults/test_kills.py",
    "faults/test_geometry_programs.py",
    "faults/test_run_kills.py",
    "faults/test_planted_modules.py",
    "faults/test_mesh_faults.py",
    "reduction/test_compressor_blade.py",
    "fe/test_fe_reduction.py",
    "parametric/test_family_fe.py",
    "fe/mesh/test_mesh_geometries.py",
    "fe/test_fe_methods_mpi.py",
    "reduction/test_methods_on_components.py",
)
