"""Run by the tests of families under mpirun: a family of panels, into one file."""

import sys

from mpi4py import MPI

import rom
from cases import panels

if sys.argv[1] == "thickness":
    family = panels.family_of_layers(panels.layered_panel())
else:
    family = rom.reduce_parametric(
        panels.panel(),
        parameters=panels.PARAMETERS,
        method=rom.CraigBampton(20),
        interfaces=panels.KINDS,
        stress=True,
        certify=False,
    )
if MPI.COMM_WORLD.rank == 0:
    rom.save(family, sys.argv[2])
