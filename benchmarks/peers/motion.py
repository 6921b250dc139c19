"""The same body file, mechanism, integrator and step in rom and in Exudyn.

Both use generalised-alpha with the same spectral radius and constraints on position level.
Processor time, one thread, the set-up of the bodies excluded. The body frame is that of the mean
axis: Exudyn lets gravity turn a body about its undeformed mass centre, which only there is right.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.models import KINDS, STEEL, geometry
from benchmarks.peers.compare import answer_of, interpreter
from benchmarks.peers.mechanisms import Described, built, chain, slider_crank
from benchmarks.peers.ours import save_matrices
from benchmarks.timing import Row, timed
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.io.native import save
from rom.mbs.integrate.simulation import simulate
from rom.model import Array, FEModel, Interface, SurfaceMesh
from rom.process.child import scratch
from rom.reduction.bases.method import CraigBampton
from rom.workflow import reduce

SCRIPT_FILE = Path(__file__).with_name("ffrf.py")
ENDS = ("root", "tip")
TIME_STEP = 2.5e-4  # of the pendulum and the slider-crank [s]; four times that for chains
N_TIMED_STEPS = 4000  # over the number of bodies
PATH_RTOL = 1e-5  # of the mechanism's size


@dataclass(frozen=True)
class Run:
    """One mechanism with one step.

    Attributes:
        mechanism: see `benchmarks.peers.mechanisms`.
        t_end: duration [s].
        steps: number of steps.
        samples: how many instants are compared; divides the number of steps.
        rho_inf: spectral radius of generalised-alpha at infinite frequency.
        times: how often it is measured; the fastest counts.
    """

    mechanism: Described
    t_end: float
    steps: int
    samples: int = 20
    rho_inf: float = 0.9
    times: int = 1

    def __post_init__(self) -> None:
        if self.steps % self.samples:
            raise ConfigError(f"{self.samples} samples do not divide {self.steps} steps.")

    @property
    def described(self) -> dict[str, Any]:
        """What the other program reads."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


@dataclass(frozen=True)
class Moved:
    """What came out.

    Attributes:
        rate: steps per second of processor time.
        positions: (samples + 1, 3) path of the point watched [m].
        version: of the program.
    """

    rate: float
    positions: Array
    version: str = ""


def with_all_nodes(model: FEModel) -> FEModel:
    """The model with every node on its surface, so that its body file holds the whole modes."""
    n = len(model.points)
    return replace(model, surface=SurfaceMesh(np.arange(n), np.zeros((0, 3), dtype=np.int64)))


def by_exudyn(model: FEModel, body: FlexibleBody, runs: list[Run]) -> list[Moved]:
    """Runs in Exudyn; the body made of ``with_all_nodes(model)``."""
    with scratch("peers") as folder:
        files = [str(folder / name) for name in ("body.rom.npz", "M.npz", "runs.json")]
        save(body, files[0])
        save_for_exudyn(model, files[1])
        Path(files[2]).write_text(json.dumps([run.described for run in runs]))
        answers: Any = answer_of([interpreter(), str(SCRIPT_FILE), *files])
    return [
        Moved(run.steps / found["seconds"], np.array(found["positions"]), found["version"])
        for run, found in zip(runs, answers, strict=True)
    ]


def save_for_exudyn(model: FEModel, path: str) -> None:
    """Matrices, interfaces, and weights with which nodes average to the point of a marker."""
    save_matrices(model, path, ENDS)
    with np.load(path) as data:
        arrays = dict(data)
    for k, name in enumerate(ENDS):
        arrays[f"weights_{k}"] = _weights(model.interfaces[name])
    np.savez(path, names=np.array(ENDS), **arrays)


def _weights(face: Interface) -> Array:
    """(k,) shares of the nodes in the area of a face [1]."""
    area = np.asarray(face.surface_mass.sum(axis=1)).ravel()
    return area / area.sum()


def by_rom(body: FlexibleBody, run: Run) -> Moved:
    """The same run here. A long one is timed, without its set-up, for steps are short."""
    mech, dt = built(run.mechanism, body), run.t_end / run.steps
    options: dict[str, Any] = {
        "dt": dt,
        "rho_inf": run.rho_inf,
        "save_every": run.steps // run.samples,
    }
    path = simulate(mech, t_end=run.t_end, **options).position(*run.mechanism["watch"])
    steps = max(run.steps, N_TIMED_STEPS // len(run.mechanism["bodies"]))
    setup, whole = (
        min(timed(simulate, mech, t_end=n * dt, **options)[0] for _ in range(run.times))
        for n in (1, steps)
    )
    return Moved((steps - 1) / max(whole - setup, 1e-9), path)


def measured(meshes: tuple[float, ...], links: tuple[int, ...]) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure; see `benchmarks.benchmarks.motion`."""
    for lc in meshes:
        model = with_all_nodes(rod(lc))
        body = reduced(model)
        runs = {"pendulum": Run(chain(body, 1), 400 * TIME_STEP, 400, times=3)}
        if lc == meshes[0]:
            crank = slider_crank(body, 0.04, 60.0)
            runs["slider-crank"] = Run(crank, 400 * TIME_STEP, 400, times=3)
            runs |= {f"chain of {k}": Run(chain(body, k), 800 * TIME_STEP, 200) for k in links}
        yield from _compared(model, body, runs)


def rod(lc: float) -> FEModel:
    """A connecting rod of steel with the element size lc [m], its bores called root and tip.

    Their points are the averages of their nodes, the only ones that Exudyn's markers know: those of
    a coarse mesh lie beside the axes of the bores, where the geometry has them.
    """
    from rom.fe import model as read_model

    model = read_model(geometry("connecting_rod"), material=STEEL, parameters={"lc": lc})
    bores = dict(zip(ENDS, ("pin_a", "pin_b"), strict=True))
    faces = {}
    for end, bore in bores.items():
        face = model.interfaces[bore]
        faces[end] = replace(face, name=end, origin=_weights(face) @ model.points[face.nodes])
    return replace(model, interfaces=faces)


def reduced(model: FEModel, n_modes: int = 8) -> FlexibleBody:
    """A bar with rigid ends and so many fixed-interface modes, six more in all."""
    return reduce(model, method=CraigBampton(n_modes), interfaces=dict(KINDS), certify=False)


def _compared(model: FEModel, body: FlexibleBody, runs: dict[str, Run]) -> Iterator[Row]:
    for (name, run), theirs in zip(
        runs.items(), by_exudyn(model, body, list(runs.values())), strict=True
    ):
        ours = by_rom(body, run)
        case, aim = f"{name}, {body.n_modes} modes, {model.n_dofs} dofs", "above 10"
        if name == "chain of 64":
            aim = "above 20"
        elif model.n_dofs > 1e5:
            aim = "above 50"
        yield case, f"Exudyn {theirs.version}", theirs.rate, "steps/s", ""
        yield case, "rom", ours.rate, "steps/s", ""
        yield case, "rom over Exudyn", ours.rate / theirs.rate, "", aim
        apart = np.abs(ours.positions - theirs.positions).max() / _reach(run.mechanism, body)
        yield case, "difference of paths", apart, "of the size", f"below {PATH_RTOL:g}"


def _reach(mechanism: Described, body: FlexibleBody) -> float:
    """Length of the mechanism as it starts, stretched along x [m]."""
    return body.size + max(float(np.linalg.norm(b["at"])) for b in mechanism["bodies"].values())
