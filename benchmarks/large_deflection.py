"""Bodies of large deflection: cost of tensors, forces and steps, beside finite elements and rods.

The bar of Kane, Ryan and Banerjee spins up as one body made from two meshes, see
`benchmarks.peers.spin_up`. A step of its finite elements is one correction of Newton's method, the
least there can be: forces and tangent assembled, factored, solved once.
"""

from collections import deque
from collections.abc import Generator, Iterator
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
from numba import njit

from benchmarks.models import KINDS, STEEL, bar, geometry
from benchmarks.peers.spin_up import (
    AXIAL_STIFFNESS,
    BAR_LENGTH,
    BAR_SIDE,
    FINAL_SPEED,
    LINE_MASS,
    RISE_TIME,
    TIME_STEP,
    Run,
    by_exudyn,
    rod,
    solid,
    spun_up,
)
from benchmarks.timing import Row, timed
from rom.body.nonlinear.quartic import Quartic, n_entries
from rom.body.nonlinear.ranges import Geometric
from rom.eigen.verbs import dofs_of
from rom.mbs.equations.packing import pack
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Mechanism
from rom.model import FEModel, Material
from rom.reduction.bases.method import CraigBampton
from rom.workflow import reduce

N_COORDINATES = 30
MOST_SECONDS = {16: 50e-6, 30: 200e-6}  # for force with tangent, by number of coordinates
COARSE_CELLS, FINE_CELLS = (40, 1), (205, 4)  # hexahedra along and across the bar
SEGMENT_COUNTS = (40, 80, 160)  # of rods, and elements of Exudyn, beside the body
TIP_FORCE = 60.0  # for which the bar has shapes [N]
RANDOM_SEED = 0


def measured(
    stocky: dict[str, float],
    coarse: tuple[int, int] = COARSE_CELLS,
    fine: tuple[int, int] = FINE_CELLS,
    segments: tuple[int, ...] = SEGMENT_COUNTS,
    elements: tuple[int, ...] = SEGMENT_COUNTS,
) -> Iterator[Row]:
    """Case, quantity, value, unit and aim; times are those of the processor.

    Args:
        stocky: parameters of a beam of tetrahedra whose tensors are made.
        coarse: numbers of hexahedra along and across the bar.
        fine: the same of its second mesh.
        segments: of rods beside the body.
        elements: of Exudyn's beams beside it.
    """
    from rom.fe import model as read_model

    models = {"tetrahedra": read_model(geometry("beam"), material=STEEL, parameters=stocky),
              "hexahedra": bar_of_hexahedra(*fine)}  # fmt: skip
    for kind, model in models.items():
        case = f"{model.n_dofs} dofs of {kind}, r = {N_COORDINATES}"
        yield case, "tensors", seconds_of_tensors(model, N_COORDINATES), "s", "below 60"
    for r, most in MOST_SECONDS.items():
        compiled, interpreted = seconds_of_force(r)
        yield f"r = {r}", "force with tangent", 1e6 * compiled, "us", f"below {1e6 * most:g}"
        yield f"r = {r}", "the same with energy in Python", 1e6 * interpreted, "us", ""
    runs = list[Run]()
    for model, aim in ((bar_of_hexahedra(*coarse), ""), (models["hexahedra"], "above 1000")):
        runs.append((yield from spin_ups(model, aim)))
    each = [run.seconds / run.corrections for run in runs]
    case = f"spin-up, {models['hexahedra'].n_dofs} dofs against {coarse[0]} hexahedra"
    yield case, "time of a correction of the body", each[1] / each[0], "times", "below 1.3"
    yield from peers(segments, elements, runs[-1])


def bar_of_hexahedra(along: int, across: int) -> FEModel:
    """The bar of the spin-up as a solid, without Poisson effect as in beam theory."""
    from rom.fe import model as read_model

    material = Material(E=AXIAL_STIFFNESS / BAR_SIDE**2, nu=0.0, rho=LINE_MASS / BAR_SIDE**2)
    section = {"b": BAR_SIDE, "h": BAR_SIDE, "ny": across, "nz": across}
    size = {"L": BAR_LENGTH, "hex": 1, "nx": along} | section
    return read_model(geometry("beam"), material=material, parameters=size)


def seconds_of_tensors(model: FEModel, r: int) -> float:
    """Processor time of the tensors of r displacements, whose numbers do not matter to it [s]."""
    energy: Any = model.stresses
    E = np.random.default_rng(RANDOM_SEED).standard_normal((model.operators.n_local, r))
    energy.large_strain().gram(E[:, :1])  # compiles the forms
    taken, found = timed(lambda: Quartic.from_gram(energy.large_strain().gram(E), r))
    assert found.by_pairs
    return taken


def seconds_of_force(r: int, times: int = 2000) -> tuple[float, float]:
    """Processor time of force and tangent beyond those of small deflection [s].

    Compiled, as the steps of a mechanism ask for it; and by NumPy, with all orders and the energy.

    Args:
        r: number of coordinates; six of them belong to an interface.
        times: how often.
    """
    linear = reduce(bar((1.0, 0.1, 0.07), (r, 1, 1)), method=CraigBampton(r - 6), certify=False,
                    interfaces=dict(KINDS), reference="root")  # fmt: skip
    rng = np.random.default_rng(RANDOM_SEED)
    cubic, quartic = (rng.standard_normal(n_entries(r, order)) for order in (3, 4))
    energy = Quartic(linear.K, cubic, quartic)
    mech = Mechanism()
    mech.add_flexible("bar", replace(linear, quartic=energy))
    packed = pack(mech, whole=True)
    W = workspace(packed.system, len(packed.signals))
    q, v, lam = packed.q.copy(), np.zeros(6 + r), np.zeros(0)
    q[7:] = 1e-3 * rng.standard_normal(r)

    @njit  # type: ignore[untyped-decorator]
    def expanded(s: Any, W: Any, q: Any, v: Any, lam: Any, times: int) -> None:
        for _ in range(times):
            for k in range(s.elements.shape[0]):
                residuals(s, k, W, q, v, lam)
                tangents(s, k, W, lam, 1.0, 0.0)

    expanded(packed.system, W, q, v, lam, 1)
    compiled, _ = timed(expanded, packed.system, W, q, v, lam, times)
    plain, _ = timed(lambda: deque((energy.expansion(q[7:]) for _ in range(times)), maxlen=0))
    return compiled / times, plain / times


def spin_ups(model: FEModel, aim: str) -> Generator[Row, None, Run]:
    """Rows of a body made from a mesh beside the mesh itself; its run."""
    geometric = Geometric(loads={"tip": (0, TIP_FORCE, TIP_FORCE, 0, 0, 0)}, n_modes=2,
                          spin=(0, 0, FINAL_SPEED))  # fmt: skip
    kinds = {"root": "rbe3", "tip": "rbe3"}
    taken, made = timed(reduce, model, method=CraigBampton(8), interfaces=kinds, reference="root",
                        nonlinear=geometric, certify=False)  # fmt: skip
    run = spun_up(solid(made))
    case = f"spin-up, {model.n_dofs} dofs by {made.n_modes} coordinates"
    yield case, "reduction", taken, "s", ""
    yield case, f"{run.steps} steps of {RISE_TIME:g} s", run.seconds, "s", ""
    yield case, "largest deflection, error", run.error, "", "below 3e-4"
    full = run.steps * seconds_of_correction(model)
    yield case, f"{run.steps} corrections of the mesh, extrapolated", full, "s", ""
    yield case, "the same over the body", full / run.seconds, "times", aim
    return run


def seconds_of_correction(model: FEModel) -> float:
    """Processor time of one correction in a step of the finite elements, held at the root [s]."""
    from rom.fe.operators.aij import wrapped
    from rom.fe.operators.petsc import PETScOperators

    fe: Any = model
    strain, M = fe.stresses.finite_strain(), fe.operators.gathered(fe.operators.M)
    u, held = np.zeros(model.n_dofs), dofs_of(model.interfaces["root"].nodes)
    strain.tangent(u)  # compiles
    strain.force(u)
    start = process_time()
    K = strain.tangent(u) + M / (0.25 * TIME_STEP**2)
    factor = PETScOperators(wrapped(K.tocsr()), wrapped(M)).hold(held)
    factor(strain.force(u)[:, None])
    return process_time() - start


def peers(segments: tuple[int, ...], elements: tuple[int, ...], beside: Run) -> Iterator[Row]:
    """Rows of rods, and of Exudyn's beams, beside the body."""
    for n in segments:
        run, case = spun_up(rod(n)), f"spin-up, rod of {n} segments"
        yield case, f"{run.steps} steps of {RISE_TIME:g} s", run.seconds, "s", ""
        yield case, "largest deflection, error", run.error, "", ""
        yield case, "its time over that of the body", run.seconds / beside.seconds, "times", ""
    for n in elements:
        seconds, error, version = by_exudyn(n)
        case = f"spin-up, {n} elements of Exudyn {version}"
        yield case, f"{beside.steps} steps of {RISE_TIME:g} s", seconds, "s", ""
        yield case, "largest deflection, error", error, "", ""
        yield case, "its time over that of the body", seconds / beside.seconds, "times", ""
