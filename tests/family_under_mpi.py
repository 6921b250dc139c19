"""Run by test_family_fe.py under mpirun: a family of panels, into one file."""

import sys

from mpi4py import MPI

from test_family_fe import KINDS, PARAMETERS, panel

import rom

family = rom.reduce_parametric(
    panel(),
    parameters=PARAMETERS,
    method=rom.CraigBampton(20),
    interfaces=KINDS,
    stress=True,
    certify=False,
)
if MPI.COMM_WORLD.rank == 0:
    rom.save(family, sys.argv[1])
