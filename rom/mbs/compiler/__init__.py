"""The compiler of kernels: all that touches parts of Numba and llvmlite which are not public.

`intermediate` leaves functions that only kernels call as they are written until a kernel takes
them in; `cache` keeps compiled code, and lets one of several processes make it; `table_types` has
kernels read tables as one address; `calls` has them call each other, and C, by addresses.

The bound in ``pyproject.toml`` ends with the newest Numba tested. When there is a newer one:

1. Raise the bound, and the version in ``.ci/light.txt``; run ``make setup``.
2. ``.venv-light/bin/python -m rom doctor --compile`` calls all that is here; what has moved in
   Numba is an ImportError or AttributeError of one of the four files. Debian 12 has 0.56: try a new
   name first, where both are in use, and never compare versions.
3. ``pytest tests/mbs/equations tests/doctor``: what was kept is found again, code of other sources
   and versions never. Numba may store its index in another form: see `cache`.
4. Processor time of first uses, ``rom bench start``, and of steps, ``rom bench integrator``, before
   and after: passes may have changed that ``intermediate`` leaves out without an error.
"""
