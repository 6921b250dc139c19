"""Run by the tests of families under mpirun: a family of panels, into one file."""

import sys

from mpi4py import MPI

import test_family_fe
import test_family_thickness

import rom

if sys.argv[1] == "thickness":
    family = test_family_thickness.families(test_family_thickness.panel())
else:
    family = rom.reduce_parametric(
        test_family_fe.panel(),
        parameters=test_family_fe.PARAMETERS,
        method=rom.CraigBampton(20),
        interfaces=test_family_fe.KINDS,
        stress=True,
        certify=False,
    )
if MPI.COMM_WORLD.rank == 0:
    rom.save(family, sys.argv[2])
