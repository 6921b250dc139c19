"""Run by test_fe_foreseen.py under mpirun: a factor on a disk that another fills meanwhile."""

import sys
from shutil import disk_usage

import rom
from cases.solid import STEEL
from rom.fe.operators import factor
from rom.fe.operators.disk import scratch_folder

BLOCK = {"L": 1.0, "b": 0.5, "h": 0.3, "lc": float(sys.argv[1])}
LEFT_BYTES = int(sys.argv[2])  # of a disk that others have filled
model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=BLOCK, solver="out-of-core")
comm, tried = model.operators.comm, factor.reserve_disk


def fills(*wanted):
    """The disk is large enough, and then it is not."""
    tried(*wanted)
    if comm.rank == 0:
        size = disk_usage(scratch_folder()).free - LEFT_BYTES
        (scratch_folder() / "another").write_bytes(bytes(size))
    comm.Barrier()


factor.reserve_disk = fills
sys.stdout.write("begins\n")
sys.stdout.flush()
model.operators.hold(model.interfaces["root"].dofs)
sys.stdout.write("has a factor\n")
