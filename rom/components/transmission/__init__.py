"""Geared shafts on journal bearings: where they rest, whether they whirl, how they vibrate.

`shaft` and `solid_shaft` spin in a `housing`, `unit` puts them together and finds where they rest;
as a `mechanism` they move in `motion`, which has their response to the mesh, and in `steady` those
that repeat with it; `supports` has the whirl of one shaft; `loaded` draws teeth and films as they
bear.
"""

from rom.lazy import front

front(__name__)
