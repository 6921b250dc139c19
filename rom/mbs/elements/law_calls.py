"""How laws of force are called: what they are given, what they answer, and their entry in C."""

from typing import Any, NamedTuple

import numba

from rom.mbs.compiler.calls import c_function
from rom.mbs.compiler.intermediate import INTERMEDIATE_OPTIONS
from rom.mbs.kernels.compiled import OPTIONS
from rom.mbs.parts.foreign import compiled_function

MOTION_SIZE = 18  # numbers of the motion of a marker
ENERGY_SIZE = 2  # stored energy, lost power
# steps of the differences of laws [m and rad], [m/s and rad/s], both relative to one plus the value
DIFFERENCE_STEP = 1e-6
# as numba.cfunc takes it
LAW_TYPES = "void(f8, CPointer(f8), CPointer(f8), CPointer(f8), CPointer(f8))"


class Motion(NamedTuple):
    """How K markers move, in the world.

    Attributes:
        position: (K, 3) [m].
        axes: (K, 3, 3) axes of each marker as columns.
        velocity: (K, 3) [m/s].
        omega: (K, 3) angular velocity [rad/s].
    """

    position: Any
    axes: Any
    velocity: Any
    omega: Any


class Answer(NamedTuple):
    """What a law says; zeros where it leaves a field alone, and the old memory.

    Attributes:
        force: (K, 3) on each marker, world [N].
        moment: (K, 3) about each marker, world [N m].
        energy: (1,) stored [J].
        lost: (1,) power turned into heat [W].
        memory: (m,) to be remembered when the step is accepted.
        outputs: (o,) values for the record.
    """

    force: Any
    moment: Any
    energy: Any
    lost: Any
    memory: Any
    outputs: Any


def motion_of(flat: Any, n: int) -> Motion:
    """The fields of the motion of n markers in a vector (18 n,)."""
    return Motion(
        flat[: 3 * n].reshape(n, 3),
        flat[3 * n : 12 * n].reshape(n, 3, 3),
        flat[12 * n : 15 * n].reshape(n, 3),
        flat[15 * n : 18 * n].reshape(n, 3),
    )


def answer_of(flat: Any, n: int, n_memory: int) -> Answer:
    """The fields of the answer of a law of n markers in a vector."""
    at = 6 * n + ENERGY_SIZE
    return Answer(
        flat[: 3 * n].reshape(n, 3),
        flat[3 * n : 6 * n].reshape(n, 3),
        flat[6 * n : 6 * n + 1],
        flat[6 * n + 1 : at],
        flat[at : at + n_memory],
        flat[at + n_memory :],
    )


# functions that an entry takes in may make arrays, and are calculated as Python says
_taken_in = numba.njit(**INTERMEDIATE_OPTIONS)
# for all entries, so that they are compiled once
_motion_of, _answer_of = map(_taken_in, (motion_of, answer_of))


def entries(name: str, laws: Any, sizes: Any, wanted: bool | None) -> tuple[Any, Any]:
    """Law and tangents as functions of C; None for what is missing or left to Python."""
    function, slopes = laws
    entry = _compiled(name, function, sizes, wanted)
    if slopes is None or entry is None:
        return entry, None
    return entry, _compiled(name, slopes, sizes, True, tangents=True)


def _compiled(
    name: str, function: Any, sizes: Any, wanted: bool | None, *, tangents: bool = False
) -> Any:
    if hasattr(function, "address"):
        return function

    def make(python: Any) -> Any:
        return entry_of(_taken_in(python), sizes, tangents=tangents)

    hint = "Use numbers and arrays of NumPy only, or compiled=False."
    return compiled_function(f"law {name!r}", function, make, wanted, hint)


def entry_of(function: Any, sizes: tuple[int, int, int, int], *, tangents: bool = False) -> Any:
    """A function of C that calls a compiled law, or its tangents, with arguments in their shapes.

    Sizes are the numbers of parameters, markers, remembered numbers, outputs.
    """
    p, n, m, o = sizes
    taken, answered = _motion_of, _answer_of
    n_motion, n_answer, n_rows = MOTION_SIZE * n, 6 * n + ENERGY_SIZE + m + o, 6 * n
    carray = numba.carray

    def law(t: Any, parameters: Any, motion: Any, memory: Any, out: Any) -> None:
        given, kept = carray(parameters, p), carray(memory, m)
        moved = taken(carray(motion, n_motion), n)
        function(t, given, moved, kept, answered(carray(out, n_answer), n, m))

    def slopes(t: Any, parameters: Any, motion: Any, memory: Any, out: Any) -> None:
        given, kept = carray(parameters, p), carray(memory, m)
        moved, D = taken(carray(motion, n_motion), n), carray(out, (2, n_rows, n_rows))
        function(t, given, moved, kept, D[0], D[1])

    return numba.cfunc(LAW_TYPES)(slopes if tangents else law)


def compiled_entry(function: Any, types: str) -> Any:
    """A function of C, compiled of one of a module and kept; it makes arrays of pointers."""
    options = {name: value for name, value in OPTIONS.items() if name != "cache"} | {"_nrt": True}
    return c_function(function, types, options)
