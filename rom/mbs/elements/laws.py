"""Laws of force between any markers, written by the user in Python, with Numba or in C.

The law of K markers is a function

``law(t, parameters, motion, memory, out)``

of the time [s], of the numbers it was given, of the `Motion` of its markers in the world, and of
what it remembered at the last accepted instant; it fills the `Answer` ``out``. In C it is

``void law(double t, const double *parameters, const double *motion, const double *memory,
double *out)``

with the fields of `Motion` and `Answer` behind each other. The derivatives of forces and moments
by small motions and by velocities of the markers come from central differences, or from a second
function ``tangents(t, parameters, motion, memory, K, C)`` that fills both (6 K, 6 K) matrices: rows
are force and moment of each marker, columns its displacement and small rotation, or its velocity
and angular velocity, all in the world. In C it gets one array, both matrices row by row.

A law that is asked twice at one instant must give the same answer twice; forces, energy and memory
also when it then finds the memory that it wrote itself the first time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import intrinsic

from rom.arguments import finite, shortened
from rom.errors import ConfigError
from rom.mbs.compiler.calls import called
from rom.mbs.elements.family import Family, Hold, Hooks, Places, integers, starts
from rom.mbs.elements.law_calls import (
    DIFFERENCE_STEP,
    ENERGY_SIZE,
    MOTION_SIZE,
    AskedForce,
    AskedLaw,
    entries,
)
from rom.mbs.kernels.algebra import add, cross, scale, unit
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import (
    Address1,
    Array1,
    Index1,
    Index2,
    Scratch1,
    Scratch2,
    Table,
    table,
)
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.foreign import Entry, Function, in_python
from rom.mbs.parts.joints import Whole
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Law:
    """A law of force between markers.

    Attributes:
        function, tangents: of the user; tangents None for differences.
        markers: it acts on.
        parameters, memory: (p,), (m,) numbers it is given, and that it remembers at the start, in
            its own units.
        outputs: names of its own outputs.
        stores: whether it accounts for its energy and its losses.
        compiled: entries in C with attribute ``address``, None where Python is asked.
        every: from one sample to the next [s]; None if it is asked whenever the forces are.
    """

    function: Function
    tangents: Function | None
    markers: tuple[Marker, ...]
    parameters: Array
    memory: Array
    outputs: tuple[str, ...]
    stores: bool
    compiled: tuple[Entry | None, Entry | None]
    every: float | None = None

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of markers, remembered numbers and outputs."""
        return len(self.markers), self.memory.size, len(self.outputs)


@dataclass(frozen=True, slots=True)
class UserForce(Law):
    """Force and moment from a Python function, on one marker and back on another."""


def law(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    function: Any,
    *markers: Marker,
    parameters: npt.ArrayLike = (),
    memory: npt.ArrayLike = (),
    outputs: Sequence[str] = (),
    energy: bool = False,
    tangents: Any = None,
    compiled: bool | None = None,
    every: Hold = None,
) -> None:
    """Force law of your own between any markers, see `rom.mbs.elements.laws`.

    It takes part in motions, equilibria, linearisation, audit, checkpoints and FMUs as all others.
    `rom.check_law` looks for mistakes in it.

    Args:
        function: ``law(t, parameters, motion, memory, out)``; a function of Python, compiled by
            Numba when it can be, one of Numba, or anything with an ``address`` in C.
        markers: at least one, of any bodies or the ground.
        parameters: (p,) numbers handed to the law, in its own units.
        memory: (m,) numbers remembered from step to step, at the start, in its own units.
        outputs: names of its own outputs; ``solution.law(name)`` has them.
        energy: whether it tells stored energy and lost power. If not, all its work is that of an
            applied force, and equilibria let it grow with the loads.
        tangents: likewise, of the derivatives; None for differences.
        compiled: True to insist, False to leave it to Python, None for what works. Compiled laws
            see outer variables as they were when the law was added.
        every: see `rom.mbs.elements.motors.motor`.

    Raises:
        ConfigError: for no marker, or a law that cannot be compiled although it must, or is to be
            sampled and in C.
    """
    given = {"function": function, "tangents": function if tangents is None else tangents}
    for what, one in given.items():
        if not callable(one) and not hasattr(one, "address"):
            raise ConfigError(f"{what} = {shortened(one)} of {name!r} must be a function.")
    numbers = finite(f"parameters of {name}", parameters, (np.size(parameters),))
    kept = finite(f"memory of {name}", memory, (np.size(memory),))
    if not markers:
        raise ConfigError(f"law {name!r} needs a marker to act on.")
    sizes = len(markers), kept.size, len(outputs)
    asked = in_python(f"law {name!r}", function, every, compiled)
    called = entries(name, (function, tangents), (numbers.size, *sizes), asked)
    element = Law(function, tangents, markers, numbers, kept, tuple(outputs), energy, called, every)
    self.add(name, element, LAWS_FAMILY)


def user_force(
    self: Whole,
    name: str,
    function: Callable[..., Any],
    m1: Marker,
    m2: Marker | None = None,
    *,
    every: Hold = None,
) -> None:
    """Force law in Python: ``function(t, a)`` or ``function(t, a, b)``.

    ``a`` and ``b`` are `rom.mbs.elements.law_calls.MarkerMotion`. The function returns
    (force, moment) in the world that act on the first marker; the reaction, at the same place in
    space, acts on the body of the second one, so that momentum is conserved whatever the law.
    ``every`` as of `rom.mbs.elements.motors.motor`.
    """
    markers = (m1,) if m2 is None else (m1, m2)
    none = np.zeros(0)
    element = UserForce(function, None, markers, none, none, (), False, (None, None), every)
    self.add(name, element, LAWS_FAMILY)


@table
class Laws(Table):
    """All laws."""

    address: Address1  # (e,) 0 for Python
    slopes: Address1  # (e,) of their tangents, 0 for differences
    count: Index1  # (e,) number of markers
    marker: Index2  # (e, K) -1 beyond
    parameter_at: Index1  # (e + 1,) where the parameters of each begin
    answer_at: Index1  # (e + 1,) where the answers do
    memory_at: Index1  # (e + 1,) where the remembered numbers do
    parameters: Array1  # (p,) of all
    first: Array1  # (m,) what they remember at the start
    stores: Index1  # (e,) 1 for laws that account for their energy
    clock: Index1  # (1,) function that tells the time
    motion: Scratch1  # (18 K,) of the markers of the law at hand
    answer: Scratch1  # (a,) of all
    probe: Scratch2  # (2, largest) of one at markers moved to both sides
    D: Scratch1  # (72 K^2,) derivatives of the law at hand by motions and by velocities, row by row
    derivatives_at: Index1  # (e + 1,) where those of laws in Python begin
    derivatives: Scratch1  # (d,) all of them


def pack(laws: Mapping[str, Law], places: Places) -> Laws:
    """The laws as arrays."""
    found = list(laws.values())
    most = max(len(law.markers) for law in found)
    marker = np.full((len(found), most), -1, dtype=np.int64)
    for e, law in enumerate(found):
        marker[e, : len(law.markers)] = [places.marker[m] for m in law.markers]
    sizes = [6 * n + ENERGY_SIZE + m + o for n, m, o in (law.sizes for law in found)]
    remembered = [law.memory.size for law in found]
    derivatives = starts([72 * len(x.markers) ** 2 if x.compiled[0] is None else 0 for x in found])
    return Laws(
        *(integers(getattr(law.compiled[k], "address", 0) for law in found) for k in (0, 1)),
        integers(len(law.markers) for law in found),
        marker,
        starts([law.parameters.size for law in found]),
        starts(sizes),
        places.memory("laws", np.concatenate([law.memory for law in found])) + starts(remembered),
        np.concatenate([law.parameters for law in found]),
        np.concatenate([law.memory for law in found]),
        integers(law.stores and law.compiled[0] is not None for law in found),
        integers([places.clock()]),
        np.zeros(MOTION_SIZE * most),
        np.zeros(sum(sizes)),
        np.zeros((2, max(sizes))),
        np.zeros(72 * most * most),
        derivatives,
        np.zeros(derivatives[-1]),
    )


@intrinsic
def call(_context, address, time, parameters, motion, memory, out):
    """Call a law, or its tangents, at an address."""
    return called(types.void(address, time, parameters, motion, memory, out))


@inner
def take_motion(laws, e, W):
    """Copy the motion of the markers of law e."""
    n = laws.count[e]
    for k in range(n):
        m = laws.marker[e, k]
        for p in range(3):
            laws.motion[3 * k + p] = W.P[m, p]
            laws.motion[12 * n + 3 * k + p] = W.V[m, p]
            laws.motion[15 * n + 3 * k + p] = W.V[m, 3 + p]
            for q in range(3):
                laws.motion[3 * n + 9 * k + 3 * p + q] = W.E[m, p, q]


@inner
def begin(s, laws, e, W, out):
    """Clear an answer of law e but for the memory; its parameters, memory and the time."""
    m, at = laws.memory_at[e], 6 * laws.count[e] + 2
    for k in range(laws.answer_at[e + 1] - laws.answer_at[e]):
        out[k] = 0.0
    for k in range(laws.memory_at[e + 1] - m):
        out[at + k] = W.base[s.coordinates.kind.size + m + k]
    parameters = laws.parameters[laws.parameter_at[e] : laws.parameter_at[e + 1]]
    return parameters, W.base[s.coordinates.kind.size + m :], W.signal[laws.clock[0], 0]


@inner
def ask_law(s, laws, e, W, out):
    """Let law e answer for the motion at hand."""
    parameters, memory, t = begin(s, laws, e, W, out)
    call(laws.address[e], t, parameters, laws.motion, memory, out)


@residuals.of(Laws)
def law_wrenches(s, W, laws, _q, _v, _lam):
    """Add the laws to the wrenches on the markers, their powers, and what they will remember."""
    for e in range(laws.address.size):
        n, answer = laws.count[e], laws.answer[laws.answer_at[e] :]
        if laws.address[e] != 0:
            take_motion(laws, e, W)
            ask_law(s, laws, e, W, answer)
        stores, factor = laws.stores[e] == 1, W.load[0]
        for k in range(n):
            m = laws.marker[e, k]
            for p in range(3):
                force = answer[3 * k + p] * (1.0 if stores else factor)
                moment = answer[3 * n + 3 * k + p] * (1.0 if stores else factor)
                W.wrench[m, p] += force
                W.wrench[m, 3 + p] += moment
                if not stores:
                    W.power[1] += force * W.V[m, p] + moment * W.V[m, 3 + p]
        if stores:
            W.power[2] += answer[6 * n + 1]
        for k in range(laws.memory_at[e + 1] - laws.memory_at[e]):
            W.fresh[laws.memory_at[e] + k] = answer[6 * n + 2 + k]


@tangents.of(Laws)
def law_tangents(s, W, laws, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for e in range(laws.address.size):
        take_motion(laws, e, W)
        factor = 1.0 if laws.stores[e] == 1 else W.load[0]
        set_derivatives(s, W, laws, e)
        for a in range(laws.count[e]):
            for b in range(laws.count[e]):
                place_block(s, W, laws, (e, 0, a, b), ck * factor, W.Kt)
                place_block(s, W, laws, (e, 1, a, b), cc * factor, W.S)


@inner
def place_block(s, W, laws, place, factor, S):
    """Add minus a factor times the derivative of the wrench on marker a by marker b to S."""
    e, which, a, b = place
    n = 6 * laws.count[e]
    W.Q[:] = 0.0
    for p in range(6):
        for q in range(6):
            at = (which * n + 6 * a + p) * n + 6 * b + q
            W.Q[p, (0 if a == b else 6) + q] = -factor * laws.D[at]
    pair_stiffness(s, W, laws.marker[e, a], laws.marker[e, b], S)


@inner
def set_derivatives(s, W, laws, e):
    """Set laws.D to the derivatives of the wrenches of law e."""
    n = laws.count[e]
    if laws.address[e] == 0:
        for k in range(72 * n * n):
            laws.D[k] = laws.derivatives[laws.derivatives_at[e] + k]
        return
    if laws.slopes[e] != 0:
        laws.D[: 72 * n * n] = 0.0
        parameters, memory, t = begin(s, laws, e, W, laws.probe[0])
        call(laws.slopes[e], t, parameters, laws.motion, memory, laws.D)
        return
    for b in range(n):
        for q in range(6):
            h = moved_by(laws, e, W, b, q, DIFFERENCE_STEP)
            ask_law(s, laws, e, W, laws.probe[0])
            moved_by(laws, e, W, b, q, -DIFFERENCE_STEP)
            ask_law(s, laws, e, W, laws.probe[1])
            take_motion(laws, e, W)
            store_column(laws, n, 6 * b + q, h)
            at = (12 if q < 3 else 15) * n + 3 * b + q % 3
            before = laws.motion[at]
            h = DIFFERENCE_STEP * (1.0 + abs(before))
            laws.motion[at] = before + h
            ask_law(s, laws, e, W, laws.probe[0])
            laws.motion[at] = before - h
            ask_law(s, laws, e, W, laws.probe[1])
            laws.motion[at] = before
            store_column(laws, n, 6 * (n + b) + q, h)


@inner
def moved_by(laws, e, W, b, q, h):
    """Displace or turn marker b of law e by h from where it is; says by how much."""
    n, m = laws.count[e], laws.marker[e, b]
    if q < 3:
        h *= 1.0 + abs(W.P[m, q])
        laws.motion[3 * b + q] = W.P[m, q] + h
        return h
    for k in range(3):
        axis = (W.E[m, 0, k], W.E[m, 1, k], W.E[m, 2, k])
        about = cross(unit(q - 3), axis)
        # to second order, so that central differences are exact to that order
        axis = add(axis, add(scale(h, about), scale(0.5 * h * h, cross(unit(q - 3), about))))
        for p in range(3):
            laws.motion[3 * n + 9 * b + 3 * p + k] = axis[p]
    return h


@inner
def store_column(laws, n, motion, h):
    """Set a column of laws.D to the derivative of all wrenches, from the two probes."""
    column = motion % (6 * n) + (motion // (6 * n)) * 36 * n * n
    for a in range(n):
        for p in range(3):
            for part in range(2):
                at = 3 * n * part + 3 * a + p
                change = laws.probe[0, at] - laws.probe[1, at]
                laws.D[(6 * a + 3 * part + p) * 6 * n + column] = 0.5 * change / h


@energy.of(Laws)
def law_energy(s, W, laws, _q, _v):
    """Energy stored by the laws that account for it."""
    total = 0.0
    for e in range(laws.address.size):
        if laws.stores[e] == 1:
            take_motion(laws, e, W)
            ask_law(s, laws, e, W, laws.probe[0])
            total += laws.probe[0, 6 * laws.count[e]]
    return total


def asked(laws: Mapping[str, Law], packed: Laws, followed: int) -> list[AskedLaw]:
    """The laws that are not compiled."""
    return [
        (AskedForce if isinstance(law, UserForce) else AskedLaw)(name, law, e, packed, followed)
        for e, (name, law) in enumerate(laws.items())
        if law.compiled[0] is None
    ]


LAWS_FAMILY = Family(
    "laws",
    Law,
    pack,
    *(law_wrenches, law_tangents, law_energy),
    ends=lambda law: law.markers,
    # a law knows where things are in the world: only a reaction is sure to conserve momentum
    outside=lambda law: not isinstance(law, UserForce) or len(law.markers) == 1,
    couples=lambda laws, body: [
        body[at[:n]] for at, n in zip(laws.marker, laws.count, strict=True)
    ],
    hooks=Hooks(
        asked=asked, answers=lambda laws: [laws.answer[i:j] for i, j in pairwise(laws.answer_at)]
    ),
)
