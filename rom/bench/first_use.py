"""Small cases of everything that is compiled when it is used first.

``python -m rom.bench.first_use NAME ...`` does some of them, one after the other, and writes for
each how many functions were compiled and how much time of the processor it took.
"""

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from time import process_time
from typing import Any

import numpy as np

from rom.bench.models import KINDS, bar, rigid_chain, slider_crank
from rom.errors import SolverError
from rom.process import child
from rom.reduction.bases.method import CraigBampton
from rom.workflow import reduce

MODULE_NAME = "rom.bench.first_use"  # also where it is run as a program
ORIGIN, Z_AXIS = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
STEPS = {"t_end": 2e-4, "dt": 1e-4}


def pendulum() -> Any:
    """A rigid bob on a hinge, hanging down."""
    from rom.mbs.mechanism import Mechanism

    mech = Mechanism(gravity=(0.0, -9.81, 0.0))
    bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-2,) * 3, at=(0.0, -0.3, 0.0))
    pin = bob.marker((0.0, 0.3, 0.0))
    mech.revolute("hinge", mech.ground.marker(ORIGIN), pin, axis=Z_AXIS)
    return mech


def _beam() -> Any:
    straight = bar((0.16, 0.02, 0.012), (4, 1, 1))
    return reduce(straight, method=CraigBampton(4), interfaces=KINDS, reference="root",
                  certify=False)  # fmt: skip


def _move(mechanism: Any, **how: Any) -> Any:
    from rom.mbs.integrate.simulation import simulate

    return simulate(mechanism, **(STEPS | how))


def _first_motion() -> None:
    """As in the first page of the manual: a motion, its table and its audit."""
    from rom.mbs.results.audit import audit

    moved = _move(pendulum())
    moved.reaction("hinge")
    audit(moved)


def _slider_crank() -> None:
    """What the main job asks for: a flexible rod, reactions, and a motion that goes on."""
    from rom.mbs.results.audit import audit

    mech = slider_crank(_beam())
    moved = _move(mech)
    moved.reaction("crank pin")
    audit(moved)
    _move(mech, t_end=4e-4, state=moved.final)


def _elements() -> None:
    """All stages, the kernels of all families of elements, a law of a user, and bars that touch."""
    from rom.mbs.elements.contact.impact import Impact
    from rom.mbs.kernels.stages import STAGE_KERNELS
    from rom.mbs.mechanism import FAMILIES

    for stage in STAGE_KERNELS.values():
        stage.link()
    for family in FAMILIES:
        for kernel in family.kernels:
            kernel.link()
    mech = pendulum()
    mech.law("law", lambda t, parameters, motion, memory, out: None, mech.ground.marker(ORIGIN))
    mech.rotational_spring("turn", "hinge", stiffness=1.0)
    above = mech.ground.marker((0.0, 0.0, 9.0))
    mech.capsule_on_capsule("bars", above, mech.part("bob").marker(ORIGIN), Impact(1e3),
                            radius1=0.1, radius2=0.1)  # fmt: skip
    _move(mech).element("turn")


def _formulas() -> None:
    """A motor and a force along a line by formulas, and a drive by one of time."""
    from rom.mbs.elements.formulas.codes import MUL, NUMBER, X
    from rom.mbs.elements.formulas.lines import line_law
    from rom.mbs.elements.formulas.programs import formula

    twice = formula(((X, 0.0), (NUMBER, -2.0), (MUL, 0.0)))
    mech = pendulum()
    mech.motor("motor", "hinge", twice)
    line_law(mech, "line", mech.ground.marker((0.1, 0.0, 0.0)), mech.part("bob").marker(ORIGIN),
             twice)  # fmt: skip
    _move(mech)
    twice.rate(0.0)


def _rod() -> None:
    """A rod in a mechanism: its law, and the stages of elements with laws."""
    from rom.components.cosserat import body, straight
    from rom.mbs.mechanism import Mechanism

    mech = Mechanism()
    section = {"stretch": 1e6, "bend": 100.0, "mass": 1.0, "inertia": 1e-3}
    rod = mech.add_nonlinear("rod", body(straight(1.0, 3, **section)))
    mech.spherical("hook", mech.ground.marker(ORIGIN), rod.marker("start"))
    _move(mech)


def _wind() -> None:
    from rom.components.wind.blading import blading, rotor_load
    from rom.components.wind.operation import operate
    from rom.components.wind.whole_turbine import turbine

    rotor_load(blading(), 8.0, 1.0, n_azimuths=3)
    operate(lambda t: 8.0, 0.1)
    _move(turbine(2, tower_segments=0, wind=8.0).mechanism)


def _equilibrium() -> Any:
    from rom.mbs.analysis.equilibrium import equilibrium

    mech = pendulum()
    return mech, equilibrium(mech)


def _linearize() -> None:
    from rom.mbs.analysis.linearize import linearize

    linearize(*_equilibrium())


def _rod_alone() -> None:
    """Rods outside mechanisms: their shape under load, and a motion."""
    from rom.components import cosserat

    rod = cosserat.straight(1.0, 3, stretch=1e6, bend=100.0, mass=1.0, inertia=1e-3)
    weight = cosserat.loads(rod, weight=(0.0, -9.81, 0.0))
    shape = cosserat.equilibrium(rod, weight)
    cosserat.elastic_energy(rod, shape)
    cosserat.strain(rod, shape)
    cosserat.simulate(rod, 2e-3, dt=1e-3, load=weight)


def _oil_film() -> None:
    from rom.components.journal_bearing import Groove, JournalBearing, film
    from rom.mbs.elements.films.tabulated import table_of

    for law in ("reynolds", "jfo"):
        groove = [Groove(np.pi, 0.35)]
        bearing = JournalBearing(0.1, 0.05, 1e-4, groove, cavitation=law, aligned=True)
        film(bearing, (5e-5, 1e-5), speed=300.0, viscosity=0.03)
    table_of("film", JournalBearing(0.1, 0.05, 1e-4, cells=(12, 2)))


def _loops() -> None:
    """Stones and metal, see `rom.bench.loops`."""
    from rom.bench.loops import COPPER, measured
    from rom.components.assumed_strain import rectangle, sheet, tangent

    for _ in measured(3, 2, 4, 2):
        pass
    X, triangles = rectangle((1, 1), [(0, 0), (1, 0), (1, 1), (0, 1)])
    tangent(sheet(X, triangles), COPPER, X)


def _rockfall() -> None:
    from rom.components.rockfall import Cushion, Gallery, Shear, Slab, strike

    sand, slab = Cushion.of_sand(4000.0, 1e6), Slab.of_mass(6000.0, 1.2e8)
    strike(Gallery(4000.0, 15.0, 2500.0, sand, shear=Shear(2e9), slab=slab), t_end=1e-3)


def _three_bodies() -> None:
    from rom.components.best_matching import Bodies, ShapeSphere

    bodies, x = Bodies(np.ones(3)), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    sphere = ShapeSphere(bodies)
    bodies.move(x, 0.1 * x[::-1], np.array([0.0, 1e-3]))
    n = sphere.shape(x)
    sphere.move(n, sphere.momentum(x, 0.1 * x[::-1]), np.array([0.0, 1e-3]))


CASES: dict[str, Callable[[], object]] = {
    "pendulum": _first_motion,
    "slider-crank": _slider_crank,
    "equilibrium": _equilibrium,
    "linearisation": _linearize,
    "variable steps": lambda: _move(pendulum(), dt=None),
    "bdf": lambda: _move(pendulum(), method="bdf"),
    "bdf of order 4": lambda: _move(pendulum(), method="bdf", order=4, t_end=6e-4),
    "stabilised": lambda: _move(pendulum(), stabilised=True),
    "dop853": lambda: _move(pendulum(), method="dop853"),
    "elements": _elements,
    "formulas": _formulas,
    "chain": lambda: _move(rigid_chain(12)),
    "rod": _rod,
    "wind": _wind,
    "rod alone": _rod_alone,
    "oil film": _oil_film,
    "stones and metal": _loops,
    "rockfall": _rockfall,
    "three bodies": _three_bodies,
}
DEMO_CASES = ("pendulum", "slider-crank")  # what `make demo` and the first page need


def started(
    cases: Sequence[str] = tuple(CASES), again: Sequence[str] = DEMO_CASES
) -> Iterator[tuple[str, str, float, str, str]]:
    """Case, quantity, value, unit and aim: each case in a process of its own.

    Args:
        cases: done first with nothing compiled, each over what those before it have left.
        again: done once more at the end, as after the set-up.
    """
    with child.scratch("start") as folder:
        variables = {"NUMBA_CACHE_DIR": str(folder), "OMP_NUM_THREADS": "1"}
        for name in cases:
            count, seconds = _of_process(name, variables)
            yield name, "functions compiled", count, "", ""
            yield name, "processor time", seconds, "s", ""
        for name in again:
            count, seconds = _of_process(name, variables)
            yield f"{name}, compiled before", "functions compiled", count, "", "0"
            yield f"{name}, compiled before", "processor time", seconds, "s", "below 3"
        yield "machine", "load", os.getloadavg()[0], "", ""


def _of_process(name: str, variables: Mapping[str, str]) -> tuple[int, float]:
    """Functions compiled and seconds of the processor.

    Raises:
        SolverError: if the process does not come to its end.
    """
    ended = child.run(child.python(MODULE_NAME, name), variables=variables)
    if ended.code:
        raise SolverError(f"{name}: {ended.last}")
    found = json.loads(ended.out)
    return found["functions"], found["seconds"]


def measured(name: str) -> dict[str, Any]:
    """Do a case; functions compiled and time of the processor [s], with that of imports."""
    began = process_time()
    CASES[name]()
    from rom.mbs.compiler.cache import COMPILED_FUNCTIONS

    count = len(COMPILED_FUNCTIONS)
    COMPILED_FUNCTIONS.clear()
    return {"name": name, "functions": count, "seconds": round(process_time() - began, 2)}


if __name__ == "__main__":
    for case in sys.argv[1:]:
        sys.stdout.write(json.dumps(measured(case)) + "\n")
        sys.stdout.flush()
