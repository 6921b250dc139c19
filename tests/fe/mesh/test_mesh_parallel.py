"""From the record to dolfinx: node order, tags, any number of ranks, errors on all of them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.files.cells import solid
from cases.long import few
from cases.ranks.environment import on_ranks

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from mpi4py import MPI  # noqa: E402

import ufl  # noqa: E402
from dolfinx import fem  # noqa: E402

from rom.fe.mesh.read import to_dolfinx  # noqa: E402

PROGRAM = """
import json, sys
from mpi4py import MPI
import numpy as np
import ufl
from dolfinx import fem
from cases.files.cells import solid
from dataclasses import replace
from rom.errors import RomError
from rom.fe.mesh.read import to_dolfinx
comm = MPI.COMM_WORLD
found = {}
for kind in ("tet4", "tet10", "hex8", "hex27"):
    box = solid(kind, (2, 1, 1), (2.0, 1.0, 1.0)) if comm.rank == 0 else None
    if box:
        halves = np.where(box.points[box.corners].mean(axis=1)[:, 0] < 1.0, 4, 9)
        names = {4: "left", 9: "right"}
        both = np.vstack([box.facets["root"], box.facets["tip"]])
        box = replace(box, regions=halves, region_names=names, facets=box.facets | {"both": both})
    mesh, regions, facets = to_dolfinx(box, comm)
    one = fem.Constant(mesh, 1.0)
    x = ufl.SpatialCoordinate(mesh)
    total = lambda form: comm.allreduce(fem.assemble_scalar(fem.form(form)))
    dx = ufl.Measure("dx", domain=mesh, subdomain_data=regions)
    found[kind] = [total(one * dx(4)), total(x[0] * dx(9))]
    for name in ("root", "tip", "both"):
        ds = ufl.Measure("ds", domain=mesh, subdomain_data=facets[name])
        found[kind].append(total((1 + x[0] + x[1] * x[2]) * ds(1)))
    cells = mesh.topology.index_map(3)
    missing = cells.size_local + cells.num_ghosts - len(np.unique(regions.indices))
    numbers = np.asarray(mesh.geometry.input_global_indices, dtype=np.int64)
    points = comm.bcast(box.points if box else None)
    off = np.abs(points[numbers] - mesh.geometry.x).max(initial=0.0)
    found[kind] += [float(comm.allreduce(missing)), float(comm.allreduce(off, op=MPI.MAX))]
bad = solid() if comm.rank == 0 else None
if bad:
    bad = replace(bad, cells=np.vstack([bad.cells, bad.cells[:1]]), regions=np.ones(73, dtype=int))
try:
    to_dolfinx(bad, comm)
    text = "no error"
except RomError as error:
    text = f"{type(error).__name__}: {error}"
texts = comm.gather(text)
if comm.rank == 0:
    print("RESULT " + json.dumps([comm.size, found, texts]))
"""
# volume of region 4, integral of x over region 9; of 1 + x + y z over root, tip and both
EXACT = [1.0, 1.5, 1.25, 3.25, 4.5, 0.0, 0.0]


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", few(2, [1, 2, 4]))
def test_integrals_tags_and_errors_are_the_same_on_any_number_of_ranks(ranks):
    """Two bricks on four ranks: some ranks own no cell."""
    done = on_ranks(ranks, "-c", PROGRAM)
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, done.stderr[-2000:]
    size, found, texts = json.loads(lines[0].removeprefix("RESULT "))
    assert size == ranks
    for kind, values in found.items():
        assert_allclose(values, EXACT, atol=1e-12, err_msg=kind)
    assert len(texts) == ranks and len(set(texts)) == 1
    assert texts[0].startswith("MeshError: 2 cells have the same corners") and "0, 72" in texts[0]


@pytest.mark.parametrize("kind", ["tet10", "hex27"])
def test_curved_cells_keep_their_middle_nodes(kind):
    """A quadratic map is reproduced exactly only if every node lands at its place."""
    box = solid(kind, (2, 2, 2), (2.0, 1.0, 1.0))
    x, y, z = box.points.T
    bent = replace(box, points=np.column_stack([x, y + 0.1 * x * x, z + 0.2 * x * y]))
    mesh, _, facets = to_dolfinx(bent, MPI.COMM_SELF)
    volume = fem.assemble_scalar(fem.form(fem.Constant(mesh, 1.0) * ufl.dx))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=facets["root"])
    X = ufl.SpatialCoordinate(mesh)
    assert volume == pytest.approx(2.0, rel=1e-12)  # the map has determinant 1
    assert fem.assemble_scalar(fem.form(X[1] * X[2] * ds(1))) == pytest.approx(0.25, rel=1e-12)
