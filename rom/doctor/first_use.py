"""Small cases of everything that is compiled when it is used first.

``python -m rom.doctor.first_use NAME ...`` does some of them, one after the other, and writes for
each how many functions were compiled and how much time of the processor it took.
"""

import sys
from collections.abc import Callable
from functools import partial
from itertools import combinations
from time import process_time
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, identity

import rom
from rom.doctor.probes import Answer, say
from rom.fields import families, find, names

MODULE_NAME = "rom.doctor.first_use"  # also where it is run as a program
ORIGIN, Z_AXIS = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
STEPS = {"t_end": 2e-4, "dt": 1e-4}


def pendulum() -> "rom.Mechanism":
    """A rigid bob on a hinge, hanging down."""
    mech = rom.Mechanism(gravity=(0.0, -9.81, 0.0))
    bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-2,) * 3, at=(0.0, -0.3, 0.0))
    pin = bob.marker((0.0, 0.3, 0.0))
    mech.revolute("hinge", mech.ground.marker(ORIGIN), pin, axis=Z_AXIS)
    return mech


def _lattice() -> "rom.FlexibleBody":
    """A reduced bar of springs between points of a grid, 160 mm long along x."""
    grid = np.meshgrid(np.linspace(0.0, 0.16, 5), (-0.01, 0.01), (-0.01, 0.01), indexing="ij")
    x = np.array(grid).reshape(3, -1).T
    K = np.zeros((x.size,) * 2)
    for i, j in combinations(range(len(x)), 2):
        d = x[j] - x[i]
        if d @ d < 0.06**2:
            row = np.kron(np.eye(len(x))[j] - np.eye(len(x))[i], d / np.linalg.norm(d))
            K += 1e8 * np.outer(row, row)
    ends = {
        name: rom.Interface(name, nodes, x[nodes], identity(4, format="csr"), x[nodes].mean(axis=0))
        for name, nodes in (("root", np.arange(4)), ("tip", np.arange(len(x))[-4:]))
    }
    model = rom.FEModel(csr_matrix(K), 0.01 * identity(x.size, format="csr"), x, ends)
    method, kinds = rom.CraigBampton(4), dict.fromkeys(ends, "rbe2")
    return rom.reduce(model, method=method, interfaces=kinds, reference="root", certify=False)


def _move(mechanism: "rom.Mechanism", **how: Any) -> "rom.mbs.Solution":
    return rom.simulate(mechanism, **(STEPS | how))


def _first_motion() -> None:
    """As in the first page of the manual: a motion, its table and its audit."""
    moved = _move(pendulum())
    moved.reaction("hinge")
    rom.audit(moved)


def _slider_crank() -> None:
    """What the main job asks for: a flexible rod, reactions, and a motion that goes on."""
    mech, radius, speed = rom.Mechanism(gravity=(0.0, -9.81, 0.0)), 0.04, 300.0
    turning, swinging = (0.0, 0.0, speed), (0.0, 0.0, -speed * radius / 0.16)
    crank = mech.add_rigid("crank", mass=1.0, inertia=(1e-3,) * 3, at=ORIGIN, omega=turning)
    begin = {"at": (radius, 0, 0), "velocity": (0, speed * radius, 0), "omega": swinging}
    rod = mech.add_flexible("rod", _lattice(), **begin)
    end = (0.16 + radius, 0.0, 0.0)
    slider = mech.add_rigid("slider", mass=0.3, inertia=(1e-4,) * 3, at=end)
    mech.revolute("main", mech.ground.marker(ORIGIN), crank.marker(ORIGIN), axis=Z_AXIS)
    pin = crank.marker((radius, 0.0, 0.0))
    mech.revolute("crank pin", pin, rod.marker("root"), axis=Z_AXIS)
    mech.revolute("wrist pin", rod.marker("tip"), slider.marker(ORIGIN), axis=Z_AXIS)
    mech.prismatic("guide", mech.ground.marker(end), slider.marker(ORIGIN), axis=(1, 0, 0))
    mech.drive("motor", "main", lambda t: speed * t)
    moved = _move(mech)
    moved.reaction("crank pin")
    rom.audit(moved)
    _move(mech, t_end=4e-4, state=moved.final)


def _chain() -> None:
    """Enough hinges that equations are eliminated part by part."""
    mech = rom.Mechanism(gravity=(0.0, -9.81, 0.0))
    before = mech.ground.marker(ORIGIN)
    for k in range(12):
        link = mech.add_rigid(f"link {k}", mass=1.0, inertia=(1e-2,) * 3, at=(k + 0.5, 0.0, 0.0))
        mech.revolute(f"pin {k}", before, link.marker((-0.5, 0.0, 0.0)), axis=Z_AXIS)
        before = link.marker((0.5, 0.0, 0.0))
    _move(mech)


def _elements() -> None:
    """All stages, the kernels of all families of elements, a law of a user, and bars that touch."""
    from rom.mbs.kernels.stages import STAGE_KERNELS

    for stage in STAGE_KERNELS.values():
        stage.link()
    for family in families():
        for kernel in family.kernels:
            kernel.link()
    mech = pendulum()
    mech.law("law", lambda t, parameters, motion, memory, out: None, mech.ground.marker(ORIGIN))
    mech.rotational_spring("turn", "hinge", stiffness=1.0)
    ends = mech.ground.marker((0.0, 0.0, 9.0)), mech.part("bob").marker(ORIGIN)
    mech.capsule_on_capsule("bars", *ends, rom.mbs.Impact(1e3), radius1=0.1, radius2=0.1)
    _move(mech).element("turn")


def _formulas() -> None:
    """A motor and a force along a line by formulas, and a drive by one of time."""
    from rom.mbs.elements.formulas.codes import MUL, NUMBER, X
    from rom.mbs.elements.formulas.lines import line_law
    from rom.mbs.elements.formulas.programs import formula

    twice = formula(((X, 0.0), (NUMBER, -2.0), (MUL, 0.0)))
    mech = pendulum()
    mech.motor("motor", "hinge", twice)
    ends = mech.ground.marker((0.1, 0.0, 0.0)), mech.part("bob").marker(ORIGIN)
    line_law(mech, "line", *ends, twice)
    _move(mech)
    twice.rate(0.0)


CASES: dict[str, Callable[[], object]] = {
    "pendulum": _first_motion,
    "slider-crank": _slider_crank,
    "equilibrium": lambda: rom.equilibrium(pendulum()),
    "linearisation": lambda: rom.linearize(mech := pendulum(), rom.equilibrium(mech)),
    "variable steps": lambda: _move(pendulum(), dt=None),
    "bdf": lambda: _move(pendulum(), method="bdf"),
    "bdf of order 4": lambda: _move(pendulum(), method="bdf", order=4, t_end=6e-4),
    "stabilised": lambda: _move(pendulum(), stabilised=True),
    "dop853": lambda: _move(pendulum(), method="dop853"),
    "steps": lambda: rom.Stepper(pendulum(), dt=1e-4).step(),
    "elements": _elements,
    "formulas": _formulas,
    "chain": _chain,
    **{name: partial(lambda one: find("first_use", one)(), name) for name in names("first_use")},
}
DEMO_CASES = ("pendulum", "slider-crank")  # what `make demo` and the first page need


def measured(name: str) -> Answer:
    """Do a case; functions compiled and time of the processor [s], with that of imports."""
    began = process_time()
    CASES[name]()
    from rom.mbs.compiler.cache import COMPILED_FUNCTIONS

    count = len(COMPILED_FUNCTIONS)
    COMPILED_FUNCTIONS.clear()
    return {"name": name, "functions": count, "seconds": round(process_time() - began, 2)}


if __name__ == "__main__":
    for case in sys.argv[1:]:
        say(**measured(case))
