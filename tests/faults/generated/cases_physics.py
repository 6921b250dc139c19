"""Numbers that are no mistake of form and no physics: they are refused, or a warning names them."""

import numpy as np

import rom
from generated.case import Warned, Works, case
from generated.cases_reliability import matrices, skewed, spoilt
from generated.stock import KINDS, STEEL, model, origin
from rom.errors import ConfigError, MaterialError, ModelError, QualityGateError, SolverError


def unheld(folder):
    """Nothing holds the body: there is no equilibrium."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    mech.add_rigid("stone", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0))
    return rom.equilibrium(mech)


def contradicting(folder):
    """Two welds that cannot both hold after the bodies move."""
    mech = rom.Mechanism()
    points = {"a": (-1, 0, 0), "b": (0, 0, 0)}
    bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-3,) * 3, at=(1, 0, 0), markers=points)
    mech.distance("rod", origin(mech), bob.marker("b"), length=2.0)
    mech.spherical("ball", origin(mech), bob.marker("a"))
    return rom.simulate(mech, t_end=0.1, dt=0.01)


def free_free(folder):
    """Free-free modes alone have no stress at an interface that is held."""
    made = rom.reduce(model((4, 1, 1)), method=rom.FreeFree(4), interfaces=KINDS)
    mech = rom.Mechanism()
    rod = mech.add_flexible("rod", made)
    mech.fixed("clamp", origin(mech), rod.marker("root"))


GATES = (QualityGateError, ModelError, MaterialError, SolverError, ConfigError)
CASES = [
    case("a part in metres for one in millimetres", f"modes box.msh {STEEL} --scale 1000 -n 7", Warned,
         ("3000", "3e+03"), fe=True),
    case("an asymmetric mass", matrices(M=skewed), QualityGateError, "M"),
    case("a mass of inf", matrices(M=lambda A: spoilt(A, np.inf)), GATES, "M"),
    case("a stone that nothing holds", unheld, (ModelError, SolverError), "stone"),
    case("joints that contradict each other", contradicting, ModelError, ("rod", "ball")),
    case("free-free modes that are clamped", free_free, (ModelError, ConfigError), "rod"),
    case("a body that is read and moves", "simulate good.npz --hinge root --t-end 0.02 --dt 1e-3 -o out",
         (Works, Warned)),
]  # fmt: skip
