"""Benchmarks: ratios measured in one run, so that the speed of the machine cancels.

Each benchmark is a function that yields figures; ``BENCHMARKS`` lists them, ``rom bench`` runs
them.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi
from time import perf_counter
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import identity, kron

from benchmarks.models import (
    CRANK_SPEED,
    KINDS,
    STEEL,
    TITANIUM,
    bar,
    geometry,
    rigid_chain,
    slider_crank,
    top,
)
from benchmarks.timing import timed
from rom.arguments import one_of
from rom.model import FEModel
from rom.process import stopwatch as watch
from rom.process.memory import peak_bytes
from rom.reduction.bases.method import CraigBampton
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect
from rom.workflow import reduce

BED_STIFFNESS = TITANIUM.E / 0.010  # as soft as 10 mm of the same metal [N/m^3]


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured number.

    Attributes:
        benchmark: name of the benchmark.
        case: what was run.
        quantity: what was measured.
        value: the number.
        unit: its unit; "" for a ratio.
        aim: what we want it to be, in words; "" when it is for information.
    """

    benchmark: str
    case: str
    quantity: str
    value: float
    unit: str = ""
    aim: str = ""


def reduction(sizes: tuple[float, ...] = (30e3, 100e3)) -> Iterator[Figure]:
    """A whole reduction against the bare MUMPS factorisation of the same matrix.

    Two rbe2 interfaces and 20 fixed-interface modes of a beam of quadratic tetrahedra.

    Args:
        sizes: numbers of dofs aimed at; the meshes come close.
    """
    from rom.fe import model as read_model

    for size in sizes:
        model = read_model(geometry("beam"), material=STEEL, parameters=_beam(size))
        connection = connect(operators(model), model, KINDS)
        start = perf_counter()
        connection.ops.hold(connection.boundary)
        bare = perf_counter() - start
        made = reduce(model, method=CraigBampton(20), interfaces=KINDS, reference="root").provenance
        case, whole = f"{model.n_dofs} dofs", made["seconds to reduce"]
        yield Figure("reduction", case, "factorisation of K_ii", bare, "s")
        yield Figure("reduction", case, "whole reduction", whole, "s")
        yield Figure("reduction", case, "whole over factorisation", whole / bare, "", "below 3")
        spent = sum(table["seconds"] for table in made["stages"].values())
        yield Figure("reduction", case, "certified over factorisation", spent / bare)
        for row in _stage_rows(made["stages"]):
            yield Figure("reduction", case, *row)
        peak = peak_bytes() / 1024**3
        yield Figure("reduction", case, "peak memory of the process", peak, "GiB", "below 12")


def _stage_rows(stages: dict[str, dict[str, float]]) -> Iterator[tuple[str, float, str]]:
    """Quantity, value and unit of each number that stages have, seconds and flops."""
    for stage, table in stages.items():
        yield f"{stage}, all of it", table["seconds"], "s"
        for name in (watch.FACTORISATION_PIECE, watch.SOLUTION_PIECE, watch.SEARCH_PIECE):
            if name in table:
                yield f"{stage}, {table[f'number of {name}']:g} {name}", table[name], "s"
        if watch.FLOPS_NOTE in table:
            yield f"{stage}, {watch.FLOPS_NOTE}", table[watch.FLOPS_NOTE] / 1e9, "Gflop"


def large_reduction(size: float = 300e3) -> Iterator[Figure]:
    """The same at 300 000 dofs, in one process.

    Args:
        size: number of dofs aimed at.
    """
    yield from reduction((size,))


def many_modes(size: float = 30e3, counts: tuple[int, ...] = (100, 300)) -> Iterator[Figure]:
    """Modes of the beam held at its root, so many or up to the last of them: processor time.

    Args:
        size: number of dofs aimed at.
        counts: numbers of modes; Lanczos takes a minute for a thousand.
    """
    from rom.eigen.band import modes_up_to
    from rom.eigen.verbs import dofs_of
    from rom.fe import model as read_model
    from rom.reduction.full_model import operators

    model = read_model(geometry("beam"), material=STEEL, parameters=_beam(size))
    ops, root = operators(model), dofs_of(model.interfaces["root"].nodes)
    for n in counts:
        by_number, (omega, _) = timed(lambda n=n: ops.modes(ops.hold(root), n, finished=True))
        by_band, found = timed(modes_up_to, ops, root, omega[-1] / (2 * pi), 1e-3)
        case = f"{model.n_dofs} dofs, {n} modes"
        yield Figure("many-modes", case, "so many", by_number, "s")
        yield Figure("many-modes", case, "up to a frequency, with bounds", by_band, "s")
        difference = float(np.abs(found.omega[:n] / omega - 1).max())
        yield Figure("many-modes", case, "largest difference", difference, "", "below 1e-8")
        bound = float(found.error.max())
        yield Figure("many-modes", case, "largest bound", bound, "", "below 1e-6")


def integrator(turns: int = 40) -> Iterator[Figure]:
    """A slider-crank whose connecting rod has 20 fixed-interface modes, 1000 steps a turn.

    Needs no FEniCSx: the rod is a straight bar.

    Args:
        turns: how long it runs; a first turn warms up and is not counted.
    """
    from rom.mbs.integrate.simulation import simulate

    beam = bar((0.16, 0.02, 0.012), (16, 2, 1))
    method, kinds = CraigBampton(20), dict(KINDS)
    rod = reduce(beam, method=method, interfaces=kinds, reference=tuple(kinds), certify=False)
    mechanism, turn = slider_crank(rod), 2 * pi / CRANK_SPEED
    warm = simulate(mechanism, t_end=turn, dt=turn / 1000)
    run = simulate(mechanism, t_end=(turns + 1) * turn, dt=turn / 1000, state=warm.final)
    case = f"{rod.n_modes} elastic coordinates, {run.statistics['steps']} steps"
    yield Figure("integrator", case, "steps per second", run.statistics["steps_per_second"], "1/s")
    share = run.statistics["share_outside"]
    yield Figure("integrator", case, "share outside compiled code", share, "", "below 0.1")


def chain(lengths: tuple[int, ...] = (4, 16, 64, 256, 1000)) -> Iterator[Figure]:
    """Hanging chains of flexible links that swing from the horizontal: cost against length.

    Each link has 8 fixed-interface modes and six coordinates of its ends. Needs no FEniCSx.

    Args:
        lengths: numbers of links.
    """
    from benchmarks.peers import mechanisms
    from rom.mbs.integrate.simulation import simulate

    straight = bar((0.25, 0.02, 0.012), (8, 1, 1))
    link = reduce(
        straight, method=CraigBampton(8), interfaces=dict(KINDS), reference="root", certify=False
    )
    dt, per_link = 1e-3, []
    for n in lengths:
        mechanism = mechanisms.built(mechanisms.chain(link, n), link)
        steps = max(10, min(200, 6400 // n))
        warm = simulate(mechanism, t_end=2 * dt, dt=dt)
        run = simulate(mechanism, t_end=(2 + steps) * dt, dt=dt, state=warm.final)
        case, speed = f"{n} links of {link.n_modes} modes", run.statistics["steps_per_second"]
        per_link.append(1 / speed / n)
        yield Figure("chain", case, "steps per second", speed, "1/s")
    grown = per_link[-1] / per_link[len(per_link) // 2]
    case = f"{lengths[-1]} against {lengths[len(lengths) // 2]} links"
    yield Figure("chain", case, "time per step and link", grown, "", "below 2")


def adaptive(
    duration: float = 20.0, links: int = 4, turns: int = 40, top_time: float = 2.0
) -> Iterator[Figure]:
    """Steps of chosen length against those of one length, per second of the processor.

    A pendulum of one link, a chain, a slider-crank with a drive, all rigid; then a fast top with a
    small tolerance. Needs no FEniCSx.

    Args:
        duration: of the swings [s].
        links: of the chain.
        turns: of the crank.
        top_time: how long the top spins [s].
    """
    from rom.mbs.integrate.simulation import simulate

    turn = 2 * pi / CRANK_SPEED
    cases = {
        "pendulum": (rigid_chain(1), duration, 1e-3),
        f"{links} links": (rigid_chain(links), duration / 10, 1e-3),
        "slider-crank": (slider_crank(), turns * turn, turn / 1000),
    }
    for case, (mechanism, t_end, dt) in cases.items():
        speeds = []
        for step in (dt, None):
            simulate(mechanism, t_end=10 * dt, dt=step)  # compiles
            taken, run = timed(simulate, mechanism, t_end=t_end, dt=step)
            speeds.append(run.statistics["steps"] / taken)
        yield Figure("adaptive", case, "steps per second, one length", speeds[0], "1/s")
        yield Figure("adaptive", case, "steps per second, chosen length", speeds[1], "1/s")
        yield Figure(
            "adaptive", case, "chosen over one length", speeds[1] / speeds[0], "", "above 1/3"
        )
    taken, run = timed(simulate, top(), t_end=top_time, rtol=1e-6)
    case = f"top, rtol 1e-6, {run.statistics['steps']} steps"
    yield Figure("adaptive", case, "processor time", taken, "s", "below 30")


def peers(meshes: tuple[float, ...] = (0.0047, 0.00257)) -> Iterator[Figure]:
    """The same reduction by Exudyn and by SciPy with SuperLU and CHOLMOD; two processes too.

    A connecting rod, two bores, 20 modes, one thread per process. The programs are installed from
    the package index into an environment of their own, ``~/.cache/rom/peers``.

    Args:
        meshes: element sizes [m]; about 29 000 and 105 000 dofs.
    """
    from benchmarks.peers.compare import compared

    for lc in meshes:
        for case, quantity, value, unit, aim in compared(lc):
            yield Figure("peers", case, quantity, value, unit, aim)


def motion(
    meshes: tuple[float, ...] = (0.024, 0.0045, 0.00255), links: tuple[int, ...] = (4, 16, 64)
) -> Iterator[Figure]:
    """The same motion by Exudyn: steps per second, and how far apart the paths are.

    The same connecting rod of 14 modes, mechanism, generalised-alpha and step; one thread,
    processor time.

    Args:
        meshes: element sizes [m] of the rod of a pendulum; about 5000, 31 000 and 103 000 dofs.
            Slider-crank and chains have the first.
        links: lengths of the chains.
    """
    from benchmarks.peers.motion import measured

    for case, quantity, value, unit, aim in measured(meshes, links):
        yield Figure("motion", case, quantity, value, unit, aim)


def rods(lengths: tuple[int, ...] = (100, 1000, 10_000)) -> Iterator[Figure]:
    """A swinging rod: cost against the number of segments; then others, here and by Exudyn.

    A cantilever bent by 60 degrees with ten modes, and a rotor that runs up.

    Args:
        lengths: numbers of segments of the one rod, which hangs on a ball joint.
    """
    from benchmarks.peers.rods import bent, measured
    from rom.components.cosserat import body, straight
    from rom.mbs.integrate.simulation import simulate
    from rom.mbs.mechanism import Mechanism

    dt, origin, per_segment = 1e-3, (0.0, 0.0, 0.0), []
    for n in lengths:
        mechanism, steps = Mechanism(), max(10, 40_000 // n)
        section = {"stretch": 1e6, "bend": 100.0, "mass": 1.0, "inertia": 1e-3}
        rod = mechanism.add_nonlinear("rod", body(straight(10.0, n, **section)))
        mechanism.spherical("hook", mechanism.ground.marker(origin), rod.marker("start"))
        warm = simulate(mechanism, t_end=2 * dt, dt=dt)
        run = simulate(mechanism, t_end=(2 + steps) * dt, dt=dt, state=warm.final)
        speed, passes = run.statistics["steps_per_second"], run.statistics["iterations"] / steps
        per_segment.append(1 / speed / n / passes)
        yield Figure("rods", f"{n} segments", "steps per second", speed, "1/s")
    case = f"{lengths[-1]} against {lengths[0]} segments"
    grown = per_segment[-1] / per_segment[0]
    yield Figure("rods", case, "time per segment and iteration", grown, "", "below 2")
    for rows in (bent(4 * lengths[0]), measured()):
        for row in rows:
            yield Figure("rods", *row)


def blade(parameters: dict[str, float] | None = None) -> Iterator[Figure]:
    """All dofs of the dovetail flanks of a compressor blade against polynomials on them.

    With 20 fixed-interface modes. Errors are those of ten frequencies of the blade on an elastic
    bed, against all dofs.

    Args:
        parameters: of the geometry; the defaults put 1700 dofs on the flanks.
    """
    from rom.fe import model as read_model

    parameters = parameters or {"lc": 0.006, "lc_flank": 0.0025}
    model = read_model(geometry("compressor_blade"), material=TITANIUM, parameters=parameters)
    taken, f = {}, {}
    for kind in ("polynomial:3", "polynomial:4", "full"):
        kinds = dict.fromkeys(model.interface_names, kind)
        body = reduce(model, method=CraigBampton(20), interfaces=kinds, certify=False)
        taken[kind], f[kind] = body.provenance["seconds to reduce"], _on_a_bed(body, model)
        columns = sum(len(marker.hold) for marker in body.markers.values())
        case = f"{model.n_dofs} dofs, {kind}"
        yield Figure("blade", case, "interface coordinates", columns)
        yield Figure("blade", case, "whole reduction", taken[kind], "s")
    for kind in ("polynomial:3", "polynomial:4"):
        case, error = f"{model.n_dofs} dofs, {kind}", np.abs(f[kind] / f["full"] - 1).max()
        yield Figure("blade", case, "worst of ten frequencies", error, "", "below 0.001")
        yield Figure("blade", case, "times as fast", taken["full"] / taken[kind], "", "above 10")


def film(solves: int = 400) -> Iterator[Figure]:
    """Oil films of 120 x 8 cells under a journal on an orbit, each with all its derivatives.

    Then a free shaft in two of them, step by step.

    Args:
        solves: films around the orbit, each started from the one before.
    """
    from benchmarks.oil_films import measured

    for case, quantity, value, unit, aim in measured(solves):
        yield Figure("film", case, quantity, value, unit, aim)


def geared(steps: int = 20000) -> Iterator[Figure]:
    """A planetary train of six meshes in time, and what its teeth cost asked for from Python.

    Args:
        steps: of 1e-5 s.
    """
    from benchmarks.gears import measured

    for case, quantity, value, unit, aim in measured(steps):
        yield Figure("geared", case, quantity, value, unit, aim)


def transmission(
    speeds: int = 100,
    cells: tuple[int, int] = (120, 8),
    ross: bool = True,
    stage_cells: tuple[int, int] = (60, 4),
) -> Iterator[Figure]:
    """A gear unit on oil films through its speeds; coefficients of a bearing here and by ROSS.

    Then the unit of rigid shafts, by the program of its own and as a mechanism, and steps of two
    stages of solids in their housing.

    Args:
        speeds: of the pinion, 500 to 6000 rpm, each with the motion that repeats with the mesh.
        cells: of each film.
        ross: compare with ROSS, which is installed from the package index.
        stage_cells: of each film of the two stages.
    """
    from benchmarks.peers.films import (
        coefficients_compared,
        programs_compared,
        speeds_run_through,
    )
    from benchmarks.two_stages import stages_run

    for rows in (speeds_run_through, programs_compared):
        for row in rows(speeds, cells):
            yield Figure("transmission", *row)
    for row in stages_run(stage_cells):
        yield Figure("transmission", *row)
    if ross:
        for row in coefficients_compared():
            yield Figure("transmission", *row)


def wheel(families: int = 10, parameters: dict[str, float] | None = None) -> Iterator[Figure]:
    """Modes of a bladed disk: one reduced sector, one full sector, the whole wheel.

    Both kinds of sectors give all nodal diameters; the whole wheel is asked for as many modes. Time
    is that of the processor, the peak of the memory that of the process so far.

    Args:
        families: modes for each number of nodal diameters.
        parameters: of the geometry.
    """
    from benchmarks.wheel import measured

    for row in measured(geometry("bladed_disk"), families, parameters):
        yield Figure("wheel", *row)


def loops(**sizes: int) -> Iterator[Figure]:
    """Stones, postures, a bar that flows, boulders, wind: compiled loops on one processor.

    Args:
        sizes: as `benchmarks.loops.measured` takes them.
    """
    from benchmarks.loops import measured

    for case, quantity, value, unit, aim in measured(**sizes):
        yield Figure("loops", case, quantity, value, unit, aim)


def stepper(**sizes: int) -> Iterator[Figure]:
    """A controller in Python that sees each step, beside one run and runs of one step.

    Needs no FEniCSx: bodies are straight bars.

    Args:
        sizes: as `benchmarks.stepping.measured` takes them.
    """
    from benchmarks.stepping import measured

    for case, quantity, value, unit, aim in measured(**sizes):
        yield Figure("stepper", case, quantity, value, unit, aim)


def start(**cases: tuple[str, ...]) -> Iterator[Figure]:
    """Processor time of first uses with nothing compiled, and of first motions after set-up.

    Args:
        cases: as `benchmarks.starts.started` takes them.
    """
    from benchmarks.starts import started

    for case, quantity, value, unit, aim in started(**cases):
        yield Figure("start", case, quantity, value, unit, aim)


def updating(sizes: tuple[float, ...] = (2e3, 25e3)) -> Iterator[Figure]:
    """The beam updated by 240 000 responses, with a coarse and with a fine mesh: processor time.

    Args:
        sizes: numbers of dofs aimed at.
    """
    from benchmarks.updating import measured
    from rom.fe import model as read_model

    for size in sizes:
        model = read_model(geometry("beam"), material=STEEL, parameters=_beam(size))
        for row in measured(model):
            yield Figure("updating", *row)


def large_deflection(size: float = 100e3, **more: Any) -> Iterator[Figure]:
    """Tensors, forces and steps of bodies that bend far, beside finite elements, rods and Exudyn.

    Processor time. The time of the finite elements is one correction, times the number of steps.

    Args:
        size: number of dofs aimed at, of tetrahedra.
        more: as `benchmarks.large_deflection.measured` takes it.
    """
    from benchmarks.large_deflection import measured

    for case, quantity, value, unit, aim in measured(_beam(size), **more):
        yield Figure("large-deflection", case, quantity, value, unit, aim)


def studies(**sizes: int) -> Iterator[Figure]:
    """Hundreds of slider-cranks on two cores, by rom and by Exudyn; thousands of short samples.

    Args:
        sizes: as `benchmarks.studies.measured` takes them.
    """
    from benchmarks.studies import measured

    for row in measured(**sizes):
        yield Figure("studies", *row)


BENCHMARKS: dict[str, Callable[[], Iterator[Figure]]] = {
    "blade": blade,
    "film": film,
    "transmission": transmission,
    "geared": geared,
    "integrator": integrator,
    "chain": chain,
    "adaptive": adaptive,
    "loops": loops,
    "reduction": reduction,
    "large-reduction": large_reduction,
    "many-modes": many_modes,
    "wheel": wheel,
    "peers": peers,
    "motion": motion,
    "rods": rods,
    "stepper": stepper,
    "start": start,
    "studies": studies,
    "updating": updating,
    "large-deflection": large_deflection,
}


def run(names: tuple[str, ...] = ()) -> Iterator[Figure]:
    """Run benchmarks by name; all of them when no name is given.

    Raises:
        ConfigError: listing the names that exist.
    """
    for name in names or tuple(BENCHMARKS):
        yield from BENCHMARKS[one_of("benchmark", name, BENCHMARKS)]()


def _beam(n_dofs: float) -> dict[str, float]:
    """A stocky beam 1 m x 0.2 m x 0.1 m with about that many dofs of quadratic tetrahedra.

    The law was fitted to meshes of 32 000 to 282 000 dofs.
    """
    lc = 0.026 * (31572 / n_dofs) ** (1 / 2.685)
    return {"L": 1.0, "b": 0.2, "h": 0.1, "lc": lc}


def _on_a_bed(body: Any, model: FEModel) -> Any:
    """Ten frequencies [Hz] with springs under all interfaces.

    Orthonormal functions feel the bed each for itself, nodal dofs through the surface mass.
    """
    M, K = body.full_matrices()
    for name, marker in body.markers.items():
        H, S = marker.hold, model.interfaces[name].surface_mass
        felt = kron(S, identity(3)) @ H if marker.kind == "full" else H
        K = K + BED_STIFFNESS * H.T @ felt
    return np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 9))) / (2 * pi)
