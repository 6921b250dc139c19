"""Run by test_cyclic_mpi.py under mpirun, or in its own process: a wheel from a shared sector."""

import json
import sys
import warnings

from mpi4py import MPI

import numpy as np

import rom
from rom.components.wheels.sector import each_diameter


def wheel():
    """Frequencies and other numbers by name, errors by name, and diameters this rank has had."""
    model = rom.fe.model(
        "meshes/bladed_disk.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
        parameters={"lc": 0.018, "lc_blade": 0.015},
    )  # fmt: skip
    plain = rom.CyclicSector.from_model(model, fixed=("bore",), regions=("blade",))
    sector = rom.rotating_sector(plain, model)
    loaded = rom.FEModel(
        model.K, model.M, model.points, model.interfaces, (rom.Attachment("tip", 0.01),),
        operators=model.operators,
    )  # fmt: skip
    heavy = rom.CyclicSector.from_model(loaded, fixed=("bore",))
    parts = rom.substructured_sector(sector, model, n_modes=8, n_blade_modes=4)
    blades = [rom.reduced_blade(parts, model, n_modes=4)] * sector.n_sectors
    small, N = rom.reduce_sector(plain, n_modes=8), plain.n_sectors
    steady = rom.spin_up(plain, model, speed=2000.0, n_states=3)
    held = rom.held_solid(model, fixed=("bore",))
    hot = rom.Heat(9e-6, lambda x: 400.0 * np.hypot(x[:, 0], x[:, 1]) ** 2 / 0.04)
    warm = rom.spin_up(plain, model, speed=1000.0, n_states=2, heat=hot)
    x = np.sin(plain.points).ravel()
    found = {
        "at rest": rom.cyclic_modes(plain, 2, 5).omega,
        "standing": rom.cyclic_modes(plain, 0, 5).omega,
        "at speed": rom.travelling_modes(sector, 2, 6, speed=2000.0).omega,
        "reduced": rom.cyclic_modes(small, 2, 5).omega,
        "blades": rom.bladed_wheel(parts, 2, n_root=4).waves(blades, speed=2000.0)[0][:6],
        "loaded": rom.cyclic_modes(heavy, 2, 5).omega,
        "families": np.ravel([modes.omega for modes in rom.wheel_modes(plain, 3)]),
        "some": np.ravel([modes.omega for modes in rom.wheel_modes(plain, 2, diameters=(4, 1))]),
        "mistuned": rom.mistuned_wheel(plain, 2, blade="blade").modes(np.full(N, 0.1)).omega[:6],
        "over the speed": rom.wheel_campbell(sector, 2, 4, speeds=[0.0, 1000.0, 2000.0]).omega[-1],
        "certificate": [1.0 + row.value for row in small.certificate.rows],
        "steady": [x @ steady.displacements[:, -1]],
        "about it": steady.modes(3, speed=1500.0, diameter=2).omega,
        "heated": rom.cyclic_modes(rom.heated_sector(plain, model, hot), 2, 3).omega,
        "heated and held": _heated(model, hot),
        "warm": [x @ warm.displacements[:, -1]],
        "solid": rom.cyclic_modes(held, 0, 3).omega,
        "blade": [x @ plain.regions["blade"] @ x],
        "stress": [x @ sector.centrifugal @ x],
    }
    errors = {
        "interface": said(lambda: rom.CyclicSector.from_model(model, fixed=("rim",))),
        "region": said(lambda: rom.CyclicSector.from_model(model, regions=("rim",))),
        "memory": said(lambda: _in_a_megabyte(model)),
        "diameter": said(lambda: rom.wheel_modes(plain, 2, diameters=(1, 99))),
        "one rank": said(lambda: each_diameter(plain, _alone)),
        "bug": said(lambda: each_diameter(plain, [0.0].__getitem__)),
    }
    mine = []
    each_diameter(plain, mine.append)
    return {name: np.asarray(f).tolist() for name, f in found.items()}, errors, mine


def _heated(model, hot):
    return rom.modes(rom.heated(model, hot, fixed=("bore",)), 3, fixed=("bore",)).omega


def _in_a_megabyte(model):
    from rom.fe.operators import aij

    plenty, aij.allowed_bytes = aij.allowed_bytes, lambda comm: 2.0**20
    try:
        return rom.CyclicSector.from_model(model)
    finally:
        aij.allowed_bytes = plenty


def _alone(diameter):
    if diameter == 3:
        raise rom.ModesMissedError("3 modes were found.")
    return diameter


def said(call):
    """Kind and text of the error of a call."""
    try:
        call()
    except (rom.RomError, IndexError) as error:
        return f"{type(error).__name__}: {error}"
    return ""


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    every = MPI.COMM_WORLD.gather(wheel())
    if MPI.COMM_WORLD.rank == 0:
        with open(sys.argv[1], "w") as file:
            json.dump(every, file)
