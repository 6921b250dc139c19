"""Bearing coefficients here and by ROSS, against a published row; a gear unit through its speeds.

The row is that of Lund and Thomsen (1978), two axial grooves of 20 degrees, L/D = 0.5, S = 0.580.
Both programs get as many cells. ROSS cuts negative pressure off, and follows the temperature of the
oil, too, which here does not change its viscosity.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.compare import CACHE_FOLDER, answer_of, interpreter
from benchmarks.timing import Row, timed
from benchmarks.units import RigidShaft, as_mechanism, with_shafts
from rom.components.gear_mesh import GearPair, Mesh, stiffness_table
from rom.components.journal_bearing import (
    Groove,
    JournalBearing,
    coefficients,
    equilibrium,
    iso_vg,
)
from rom.components.orbits.motion import periodic_motion
from rom.components.transmission import Disc, Rotor, Shaft, Transmission, rest, steady, sweep
from rom.mbs import tooth_loads
from rom.mbs.analysis.equilibrium import equilibrium as mechanism_at_rest
from rom.model import Array

# of a wheel of charts that newer drawing libraries lack
PACKAGES = ("ross-rotordynamics==2.3.0", "plotly<6")
ROSS_FOLDER = CACHE_FOLDER / "ross"
SCRIPT_FILE = Path(__file__).with_name("ross_films.py")
ROSS_STIFFNESS = np.array([[2.67, 3.70], [-0.78, 1.75]])  # c/W, x along the load
ROSS_DAMPING = np.array([[6.96, 1.94], [1.94, 2.40]])  # c speed/W
FILM_CASE: dict[str, Any] = {
    "diameter": 0.1, "length": 0.05, "clearance": 1e-4, "viscosity": 0.03, "speed": 300.0,
    "groove_deg": 20, "cells": (53, 8), "guess": (0.5, -0.7),
}  # fmt: skip
SOMMERFELD_NUMBER, N_REPEATS = 0.580, 20
STEPS_PER_TOOTH = 60


def two_groove() -> tuple[JournalBearing, float]:
    """The bearing of the row and its load [N], which points against Y."""
    size = FILM_CASE["diameter"], FILM_CASE["length"], FILM_CASE["clearance"]
    grooves = [Groove(angle, np.radians(FILM_CASE["groove_deg"])) for angle in (0.0, np.pi)]
    bearing = JournalBearing(*size, grooves, cells=(120, 8))
    film = FILM_CASE["viscosity"] * FILM_CASE["speed"] / (2 * np.pi) * size[0] * size[1]
    return bearing, film / SOMMERFELD_NUMBER * (size[0] / 2 / size[2]) ** 2


def coefficients_compared() -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure for one bearing at rest.

    Raises:
        ResourceError: if ROSS cannot be installed, or fails.
    """
    (bearing, load), case = two_groove(), "two-groove bearing, 120 x 8 cells"
    kept = {"speed": FILM_CASE["speed"], "viscosity": FILM_CASE["viscosity"]}
    equilibrium(bearing, (0.0, -load), **kept)
    ours, found = timed(lambda: [coefficients(equilibrium(bearing, (0.0, -load), **kept))
                                 for _ in range(N_REPEATS)])  # fmt: skip
    ours, (K, C) = ours / N_REPEATS, found[-1]
    yield case, "rom, rest and coefficients", 1e3 * ours, "ms of the processor", ""
    yield case, "rom, coefficients off Lund and Thomsen", off(K, C), "", "below 0.03"
    command = [
        interpreter(ROSS_FOLDER, PACKAGES),
        str(SCRIPT_FILE),
        json.dumps(FILM_CASE | {"load": load}),
    ]
    found = answer_of(command)
    each, name = FILM_CASE["clearance"] / load, f"ROSS {found.pop('version')}"
    for method, theirs in found.items():
        K, C = (along_the_load(each * np.array(theirs[k])) for k in ("stiffness", "damping"))
        ratio = theirs["seconds"] / ours
        yield case, f"{name}, {method}, over rom", ratio, "", "above 10"
        wrong = off(K, C * FILM_CASE["speed"])
        yield case, f"{name}, {method}, coefficients off Lund and Thomsen", wrong, "", ""


def along_the_load(A: Array) -> Array:
    """(2, 2) with x along a load against Y, and y by 90 degrees from it."""
    T = np.array([[0.0, -1.0], [1.0, 0.0]])
    return T @ A @ T.T


def off(K: Array, C: Array) -> float:
    """Largest difference from the published row over the largest coefficient of each matrix."""
    parts = ((K, ROSS_STIFFNESS), (C, ROSS_DAMPING))
    return float(max(np.abs(A - B).max() / np.abs(B).max() for A, B in parts))


def gear_unit(cells: tuple[int, int] = (120, 8), torque: float = 300.0) -> Transmission:
    """26 teeth of module 4 mm drive 157 on four bearings with two grooves each, ISO VG 46 at 60 C.

    Args:
        cells: of each film.
        torque: of the pinion [N m].
    """
    pair = GearPair((26, 157), 4e-3, 0.04)
    pair = replace(pair, centre_distance=pair.distance + 1e-4)
    z, load, rotors = np.linspace(0.0, 0.2, 5), np.pi / 2 - pair.alpha, list[Rotor]()
    wheels = ((0.104, load + np.pi, (0.05, 0.025, 5e-5)), (0.628, -load, (0.09, 0.06, 8e-5)))
    for outer, angle, size in wheels:
        grooves = [Groove(angle + side * np.pi / 2, np.radians(20)) for side in (1, -1)]
        held = JournalBearing(*size, grooves, cells=cells)
        wheel = Disc.of_ring(2, outer=outer, inner=size[0], width=0.04)
        rotors.append(Rotor(Shaft(z, size[0], [wheel]), 2, {0: held, 4: held}))
    k = stiffness_table(pair, force=torque / pair.rb[0] / pair.width)
    oil = float(iso_vg(46).viscosity(60.0))
    mesh, (pinion, gear) = Mesh(pair, k, damping=2e-6), rotors
    return Transmission(pinion, gear, mesh, 100 * np.pi, torque * 157 / 26, oil)


def programs_compared(n: int, cells: tuple[int, int]) -> Iterator[Row]:
    """Case, quantity, value, unit and aim: rigid shafts, by two programs.

    That of the unit and a mechanism both find the motion that repeats with the mesh at n speeds,
    2000 to 6000 rpm, each from the one before.
    """
    unit = gear_unit(cells)
    shafts: tuple[Any, Any] = unit.pinion.shaft, unit.gear.shaft
    unit = with_shafts(unit, (RigidShaft.of(shafts[0]), RigidShaft.of(shafts[1])))
    case = f"rigid shafts, 4 films of {cells[0]} x {cells[1]} cells"
    units = [replace(unit, speed=float(w)) for w in np.linspace(2000, 6000, n) * np.pi / 30]
    one, own = timed(rest, units[0])
    two, mechanism = timed(mechanism_at_rest, as_mechanism(units[0]))
    yield case, "rest by its own program", 1e3 * one, "ms of the processor", ""
    yield case, "rest as a mechanism", 1e3 * two, "ms of the processor", ""
    taken, apart = np.zeros(2), np.zeros(n)
    for k, unit in enumerate(units):
        one, own = timed(steady, replace(own, unit=unit), steps=STEPS_PER_TOOTH)
        two, mechanism, factor = _repeating(unit, mechanism)
        taken += one, two
        apart[k] = abs(factor / own.load_factor - 1.0)
    yield case, "a speed of a sweep by its own program", taken[0] / n, "s of the processor", ""
    yield case, "a speed of a sweep as a mechanism", taken[1] / n, "s of the processor", "below 3.6"
    yield case, "mechanism over its own program", taken[1] / taken[0], "", "below 2"
    yield case, "load factors apart, middle of all speeds", float(np.median(apart)), "", ""
    yield from _read_from_tables(units, f"{case}, from tables")


def _repeating(unit: Transmission, start: Any, **films: Any) -> tuple[float, Any, float]:
    """Seconds for the motion of the unit as a mechanism that repeats, it, and its load factor."""
    how = {"period": unit.mesh_period, "start": start, "steps": STEPS_PER_TOOTH}
    seconds, found = timed(periodic_motion, as_mechanism(unit, **films), **how)
    teeth = [x.force.sum() for x in tooth_loads(found.solution, "mesh")]
    return seconds, found, float(np.max(teeth) / np.mean(teeth[1:]))


def _read_from_tables(units: list[Transmission], case: str) -> Iterator[Row]:
    """The mechanism once more with films from tables, which are made first."""
    made, first = timed(as_mechanism, units[0], tabulated=True)
    yield case, "to make the tables", made, "s of the processor", ""
    rest_time, found = timed(mechanism_at_rest, first)
    factors, taken = [], rest_time
    for unit in units:
        one, found, factor = _repeating(unit, found, tabulated=True)
        factors.append(factor)
        taken += one
    speeds = f"steady motion at {len(units)} speeds"
    yield case, speeds, taken / 60, "min of the processor", "below 6"
    yield case, "largest load factor", max(factors), "", ""


def speeds_run_through(n: int, cells: tuple[int, int]) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure for n speeds, up and down."""
    unit, speeds = gear_unit(cells), np.linspace(500, 6000, n) * np.pi / 30
    case = f"{n} speeds, 4 films of {cells[0]} x {cells[1]} cells"
    taken, up = timed(sweep, unit, speeds)
    yield case, "steady motion at all", taken / 60, "min of the processor", "below 15"
    yield case, "mesh periods run through per speed", sum(s.passes for s in up) / n, "", ""
    yield case, "largest load factor", max(s.load_factor for s in up), "", ""
    yield case, "speeds at which teeth lose contact", sum(s.apart > 0 for s in up), "", ""
    yield case, "speeds at which the motion is not stable", sum(not s.stable for s in up), "", ""
    down = sweep(unit, speeds[::-1])[::-1]
    pairs = list(zip(up, down, strict=True))
    other = sum(abs(a.error_rms / b.error_rms - 1) > 0.02 for a, b in pairs)
    yield case, "speeds with another motion on the way down", other, "", ""
