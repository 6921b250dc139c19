"""Functional Mock-up Units (FMI 2.0, co-simulation) of mechanisms.

An FMU is a zip archive with a description of its variables in XML and a shared library that other
programs load. The equations of a mechanism are not linear and their integrator is compiled by
Numba, so that the FMU of a mechanism needs Python and rom where it runs, as the FMUs of Matlab or
Java programs need those. Its library does not load Python into the program that runs it, where two
Pythons, two BLAS or a crash would meet: it starts a Python process of its own for each instance
and talks with it over a socket. Errors in that process come back as fmi2Error with their message.
`export` writes the archive, `driven` is that process, `variables` are inputs and outputs.

The archive holds the Python file that builds the mechanism and the files it reads, the library,
compiled at export by gcc for POSIX systems, and the C source of the library. The interpreter is the
one that the environment variable ROM_PYTHON names, else the one that wrote the archive, where it is
there, else python3.

A body alone, in small motions, needs none of this: `rom.io.fmu.body` writes its linear equations
as C code.

Inputs are held over a communication step H, so that an input that follows a smooth function costs
an error of order H; the time steps themselves have order two.
"""
