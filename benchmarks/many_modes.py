"""Many modes by substructuring and by Lanczos, on the same matrices."""

from collections.abc import Iterator
from math import pi

from benchmarks.timing import Row, timed
from rom.eigen.substructuring import modes_up_to
from rom.eigen.verbs import dofs_of
from rom.model import FEModel
from rom.reduction.full_model import operators

CERTAIN_RTOL = 1e-9  # of frequencies by Lanczos
ALLOWED_RTOL = 1e-3  # of those by substructuring, by their bounds


def measured(model: FEModel, counts: tuple[int, ...]) -> Iterator[Row]:
    """Processor time of so many modes of a body held at its root, and errors beside their bounds.

    Args:
        model: the body.
        counts: numbers of modes; the last frequency by Lanczos is the band of the other.
    """
    ops, root = operators(model), dofs_of(model.interfaces["root"].nodes)
    for n in counts:
        lanczos, (omega, _) = timed(lambda n=n: ops.modes(ops.hold(root), n, finished=True))
        here, found = timed(modes_up_to, ops, root, omega[-1] / (2 * pi), ALLOWED_RTOL)
        error, bound = found.omega[:n] / omega - 1, found.error[:n]
        beyond = (error / (bound + CERTAIN_RTOL)).max()
        case = f"{model.n_dofs} dofs, {n} modes"
        yield case, "block Lanczos", lanczos, "s", ""
        yield case, "substructuring", here, "s", ""
        yield case, "Lanczos over substructuring", lanczos / here, "", "above 1"
        yield case, "largest error", float(error.max()), "", ""
        yield case, "largest bound", float(bound.max()), "", f"below {ALLOWED_RTOL:g}"
        yield case, "largest error over its bound", float(beyond), "", "below 1"
