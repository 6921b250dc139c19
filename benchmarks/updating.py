"""Updating of a beam by a large test: cost beside the number of its dofs."""

from collections.abc import Iterator
from time import process_time

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from benchmarks.models import KINDS
from benchmarks.timing import Row, timed
from rom.body.surface import surface_of
from rom.components.families.parameters import Density, YoungsModulus
from rom.components.families.reduce import reduce_parametric
from rom.components.updating.estimate import update
from rom.components.updating.family_model import AddedMass, GroundSpring, family_model
from rom.components.updating.frf_data import noisy
from rom.components.updating.measured import Channels, Responses
from rom.components.updating.normal_equations import Data, responses_at, sums
from rom.model import Array, FEModel
from rom.process.memory import peak_bytes
from rom.reduction.bases.method import CraigBampton

N_SENSORS, N_INPUTS, N_LINES = 20, 3, 4000
HIGHEST_LINE = 1500.0  # [Hz]
RELATIVE_NOISE, N_AVERAGES, DAMPING_RATIO = 0.05, 50, 0.02
N_FACTORED, MAX_FACTORED_DOFS = 4, 5000  # lines and dofs of the mesh beside
TRUE_LOGS = (0.2, -0.1, 0.3, -0.3, 0.2, -0.2)  # of the six factors
BEAM_PARAMETERS = {"E": YoungsModulus(None, 0.4, 2.5), "rho": Density(None, 0.5, 2.0)}
ATTACHED_PARTS: dict[str, GroundSpring | AddedMass] = {
    "pull at the root": GroundSpring("root", (1e9, 1e9, 1e9), 0.1, 10.0),
    "turn at the root": GroundSpring("root", (0, 0, 0, 1e6, 1e6, 1e6), 0.1, 10.0),
    "pull at the tip": GroundSpring("tip", (1e6, 1e6, 1e6), 0.1, 10.0),
    "mass at the tip": AddedMass("tip", 2.0, 0.1, 10.0),
}


def measured(model: FEModel, n_lines: int = N_LINES) -> Iterator[Row]:
    """Processor time of an update with six parameters, and how far they come out from the truth.

    Args:
        model: a beam along x with the interfaces root and tip.
        n_lines: of the test, 20 sensors by 3 inputs each.
    """
    family = reduce_parametric(
        model, parameters=BEAM_PARAMETERS, method=CraigBampton(20), interfaces=KINDS, certify=False
    )
    rng = np.random.default_rng(0)
    points = surface_of(family.body).points
    points = points[points[:, 0] > points[:, 0].mean()]
    sensors, inputs = (
        Channels(points[rng.choice(len(points), n, replace=False)], rng.normal(size=(n, 3)))
        for n in (N_SENSORS, N_INPUTS)
    )
    rows = (sensors.rows(family.body, "sensor"), inputs.rows(family.body, "input"))
    true = family_model(family, rows, ATTACHED_PARTS, {}, ())
    lines = np.linspace(20.0, HIGHEST_LINE, n_lines)
    H = responses_at(true, np.array(TRUE_LOGS), np.array([DAMPING_RATIO]), 2 * np.pi * lines)
    coherence = 1 / (1 + N_AVERAGES * RELATIVE_NOISE**2)
    test = Responses(lines, noisy(H, RELATIVE_NOISE, rng), sensors, inputs, coherence, N_AVERAGES)
    spent, found = timed(update, family, test, attached=ATTACHED_PARTS)
    off = np.log(list(found.factors.values())) - TRUE_LOGS
    worst = np.abs(off / [found.deviations[name] for name in found.factors]).max()
    case = f"{model.n_dofs} dofs, {H.size} responses"
    yield case, "processor time of an update", spent, "s", "below 10"
    yield case, "peak memory of the process", peak_bytes() / 1024**3, "GiB", "below 1"
    yield case, "largest error over its deviation", float(worst), "", "below 4"
    if model.n_dofs <= MAX_FACTORED_DOFS:
        x, zeta = found.logarithms, found.zeta
        step, _ = timed(sums, found.model, x, zeta, Data.of(test))
        whole = factored(model, 2 * np.pi * lines) * len(lines) * (1 + x.size)
        what = "work of a step by differences on the mesh, over it"
        yield case, what, whole / step, "times", "above 100"


def factored(model: FEModel, omega: Array) -> float:
    """Processor time of the dynamic stiffness of a mesh, factored and solved at a line [s].

    Without it there are no responses of the mesh; for derivatives by differences it is done again
    with each factor changed. Mean over few of the lines.

    Args:
        model: with its matrices.
        omega: (n_f,) lines [rad/s].
    """
    K, M = csc_matrix(model.K), csc_matrix(model.M)
    F = np.eye(model.n_dofs, N_INPUTS)
    few = omega[:: max(1, omega.size // N_FACTORED)]
    start = process_time()
    for w in few:
        splu(((1 + 2j * DAMPING_RATIO) * K - w**2 * M).tocsc()).solve(F.astype(complex))
    return (process_time() - start) / few.size
