"""Run by test_fe_mpi.py under mpirun: a model, its modes, interfaces and surface into one file."""

import os
import signal
import sys

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.mesh import meshtags

import rom
from cases.boxes import box
from cases.solid import STEEL
from rom.fe.elasticity import assemble
from rom.fe.parallel import collective, install_abort_hook, on_root

COMM = MPI.COMM_WORLD


def model(path, cells, degree):
    mesh, tags = box((1.0, 0.2, 0.13), cells, "tetrahedron")
    both = np.union1d(tags["x1"].indices, tags["y1"].indices).astype(np.int32)
    tags["corner"] = meshtags(mesh, 2, both, np.ones(both.size, dtype=np.int32))
    made = assemble(mesh, None, tags, material=STEEL, degree=degree)
    free = rom.modes(made, 14)
    fixed = rom.modes(made, 8, fixed=("x0",))
    tied = rom.modes(made, 10, interfaces={"x0": "rbe2", "x1": "rbe2"})
    out = {"free": free.frequencies, "fixed": fixed.frequencies, "tied": tied.frequencies}
    shapes = {"free": free.shapes[:, 6:], "fixed": fixed.shapes, "tied": tied.shapes[:, 6:]}
    out["mass"] = made.mass()
    out["entries"] = made.operators.M.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"]
    for name, face in made.interfaces.items():
        out[f"points {name}"] = face.points
        out[f"mass {name}"] = face.surface_mass.toarray()
        out[f"origin {name}"] = face.origin
        for key, columns in shapes.items():
            out[f"{key} shapes {name}"] = made.operators.rows(columns, face.dofs)
    out["surface"] = made.points[made.surface.nodes]
    out["triangles"] = made.surface.triangles
    same = COMM.allgather([made.points.tobytes(), made.interfaces["x0"].nodes.tobytes()])
    assert all(other == same[0] for other in same), "ranks differ"
    if COMM.rank == 0:
        np.savez(path, **out)


def fail(kind):
    install_abort_hook()
    if kind == "one":
        if COMM.rank == COMM.size - 1:
            raise rom.MaterialError("rho = 0 on one rank.")
        COMM.Barrier()
    elif kind == "bug":
        if COMM.rank == COMM.size - 1:
            raise IndexError("nobody foresaw this")
        COMM.Barrier()
    elif kind == "together":
        with collective(COMM):
            if COMM.rank == COMM.size - 1:
                raise rom.MaterialError("rho = 0 on the last rank.")
    elif kind == "all":
        try:
            with collective(COMM):
                assert [0.0][COMM.rank] == 0.0
        except rom.ParallelError as error:
            n = COMM.allreduce(1)
            if COMM.rank == 0:
                raise rom.MaterialError(f"{n} ranks met: {error}") from error
            COMM.Barrier()
    elif kind == "root":
        on_root(COMM, lambda: 1 / 0)


def die():
    """The last rank, while the others wait for it."""
    if COMM.rank == COMM.size - 1:
        os.kill(os.getpid(), signal.SIGKILL)
    COMM.Barrier()


if sys.argv[1] == "die":
    die()
elif sys.argv[1] == "model":
    model(sys.argv[4], tuple(map(int, sys.argv[2].split(","))), int(sys.argv[3]))
else:
    fail(sys.argv[2])
