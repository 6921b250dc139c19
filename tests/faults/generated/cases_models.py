"""Odd models: of any size, with an interface of all nodes, of too many functions, or stiff."""

from dataclasses import replace

import numpy as np

import rom
from generated.case import Works, case, require
from generated.stock import model


def scaled(size):
    """The same relative frequencies at any size."""
    small = replace(model(), points=model().points * size, K=model().K * size, M=model().M * size**3,
                    interfaces={n: replace(i, points=i.points * size, origin=i.origin * size,
                                           surface_mass=i.surface_mass * size**2)
                                for n, i in model().interfaces.items()})  # fmt: skip
    return lambda folder: require(
        np.allclose(rom.modes(small, 10).frequencies[6:] * size, rom.modes(model(), 10).frequencies[6:],
                    rtol=1e-8), "other frequencies")  # fmt: skip


def whole(folder):
    """A reduction whose interface has all nodes."""
    made = model((4, 1, 1))
    n = len(made.points)
    root = replace(made.interfaces["root"], nodes=np.arange(n), points=made.points,
                   surface_mass=np.eye(n), origin=made.points.mean(axis=0))  # fmt: skip
    rom.reduce(replace(made, interfaces={"root": root}), method=rom.Guyan(), certify=False,
               interfaces={"root": "full"})  # fmt: skip


def explicit(folder):
    """A stiff spring and an explicit method, which chooses its step itself."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bob = mech.add_rigid("bob", mass=1e-6, inertia=(1e-9,) * 3, at=(1, 0, 0)).marker((0, 0, 0))
    mech.spring_damper("spring", mech.ground.marker((0, 0, 0)), bob, stiffness=1e9, free_length=0.9)
    sol = rom.simulate(mech, t_end=1e-6, dt=1e-7, method="dop853")
    require(np.abs(sol.position("bob")).max() < 2, "it grew")


def unresolved(folder):
    """An order of polynomials beyond what the nodes can tell apart."""
    made = rom.reduce(model(), method=rom.Guyan(), certify=False,
                      interfaces={"root": rom.Polynomial(3), "tip": "rbe2"})  # fmt: skip
    require(made.n_modes == 12 and np.linalg.eigvalsh(made.K)[0] > 0, "more shapes than dofs")


CASES = [
    case("a small one", scaled(1e-9), Works),
    case("a large one", scaled(1e6), Works),
    case("an interface of all nodes", whole, Works),
    case("too many polynomials", unresolved, Works),
    case("a stiff spring", explicit, Works),
]  # fmt: skip
