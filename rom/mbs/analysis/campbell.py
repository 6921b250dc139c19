"""Natural frequencies over the speed of rotation, each mode followed by its shape."""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from rom.arguments import Ascending, Count, typed, unit_vector
from rom.errors import ConfigError, warn
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.linearize import Linearization, linearize
from rom.mbs.analysis.local_equations import MAX_DENSE
from rom.mbs.analysis.rotors.blades import Blades
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array, Index
from rom.process.spreading import spread

N_SPARE = 6  # modes computed beyond twice those followed
SPEED_RTOL = 1e-3  # by which the body nearest to a speed may miss it
FREQUENCY_WEIGHT = 0.1  # weight of the relative change of frequency beside that of the shape
Turned = Mechanism | Callable[[float], Mechanism | tuple[Mechanism, State]]


@dataclass(frozen=True)
class Campbell:
    """Modes over speed.

    Attributes:
        speeds: (s,) [rad/s].
        eigenvalues: (s, m) [rad/s]; a column follows one mode.
        mac: (s - 1, m) likeness of its shapes at neighbouring speeds, 1 for the same shape [1];
            below a half the speeds are too far apart to be sure of it, or two modes share a
            frequency.
        waves: (s, m, 3) shares of the motion of ``blades`` that all have alike, and that run
            around the support backward and forward [1]; None without blades.
    """

    speeds: Array
    eigenvalues: Array
    mac: Array
    waves: Array | None = None

    @property
    def frequencies(self) -> Array:
        """(s, m) [Hz]."""
        return self.eigenvalues.imag / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """(s, m) share of critical damping [1]; negative where a motion grows."""
        size = np.abs(self.eigenvalues)
        return -self.eigenvalues.real / np.where(size > 0, size, 1.0)

    def crossings(self, order: float = 1.0) -> tuple[tuple[int, float], ...]:
        """(mode, speed [rad/s]) where a mode meets a multiple of the speed, between the speeds.

        Modes count from zero. Positions are interpolated linearly: take speeds close enough.
        """
        gap = self.eigenvalues.imag - order * self.speeds[:, None]
        found = []
        for k in range(gap.shape[1]):
            for i in np.flatnonzero((gap[:-1, k] * gap[1:, k] < 0) | (gap[1:, k] == 0)):
                share = gap[i, k] / (gap[i, k] - gap[i + 1, k])
                step = self.speeds[i + 1] - self.speeds[i]
                found.append((k, float(self.speeds[i] + share * step)))
        return tuple(found)


@typed
def campbell(  # noqa: PLR0913
    mechanism: Turned,
    speeds: Annotated[npt.ArrayLike, Ascending("rad/s")],
    *,
    n: Annotated[int, Count(1)] | None = None,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    frame: object = "body",
    blades: object = None,
    executor: Executor | None = None,
) -> Campbell:
    """Follow the natural frequencies over the speed of rotation.

    Args:
        mechanism: the mechanism, which turns as a whole and takes its equilibrium at each speed;
            or a function of the speed that returns a mechanism already turning, or a pair of
            mechanism and state.
        speeds: (s,) [rad/s], at least two, in order; above zero if the mechanism as a whole
            turns freely, for then nothing holds it at speed zero.
        n: number of modes to keep, lowest at the first speed first; None for all. Motions that
            are free at all speeds are left out. With a state, of a large mechanism only twice as
            many are computed at each speed; one that leaves these has a small ``mac``.
        axis: (3,) axis of the rotation of a mechanism as a whole, world [1].
        about: (3,) a point on it [m].
        frame: axes for small motions, see `linearize`: "world" for rotors in bearings.
        blades: names of the bodies of each blade of a rotor on a support, see `linearize`; the
            function then returns a state, too, from ``rom.equilibrium(..., spin={joint: speed})``.
        executor: of `concurrent.futures`, whose workers share the speeds; None for none.

    Raises:
        ConfigError: for wrong speeds or a wrong mechanism.
        ModelError, SolverError: see `equilibrium` and `linearize`.

    Warns:
        RomWarning: where no body turns at the speed, as when a drive prescribes another one.
    """
    speeds = np.asarray(speeds, dtype=float)
    axis = unit_vector("axis", axis)
    counted = partial(linearize, frame=frame, blades=blades)
    at = partial(
        _at, mechanism=mechanism, axis=axis, about=about, n=n, counted=counted, blades=blades
    )
    found = spread(at, speeds.tolist(), executor)
    orders: list[Index] = [np.arange(found[0].eigenvalues.size)]
    likeness = []
    for one, two in pairwise(found):
        follow, mac = _follow(one, two, orders[-1])
        orders.append(follow)
        likeness.append(mac)
    ordered = list(zip(found, orders, strict=True))
    values = np.array([x.eigenvalues[order] for x, order in ordered])
    kept = np.flatnonzero(np.abs(values).max(axis=0) > 0)[:n]
    waves = None
    if blades is not None:
        waves = np.array([x.waves[order][kept] for x, order in ordered if x.waves is not None])
    return Campbell(speeds, values[:, kept], np.array(likeness)[:, kept], waves)


class Modes(NamedTuple):
    """Of one speed, as far as a diagram needs them."""

    eigenvalues: Array  # (f,) [rad/s]
    shapes: Array  # (n, f)
    scale: Array  # (n,), see `Linearization`
    waves: Array | None  # (f, 3) how the blades take part


def _waves(found: Linearization, blades: object) -> Array:
    """(f, 3) how the blades take part in all modes at one speed."""
    rotor = Blades.of(blades, found.packed, found.state)
    return rotor.waves(found.shapes / found.scale[:, None], found.state)


def _at(
    speed: float,
    mechanism: Turned,
    axis: Array,
    about: npt.ArrayLike,
    n: int | None,
    counted: Callable[..., Linearization],
    blades: object,
) -> Modes:
    """Modes at one speed; of large mechanisms some more than n, so that they can be followed."""
    made: Mechanism | tuple[Mechanism, State]
    if isinstance(mechanism, Mechanism):
        made = mechanism, equilibrium(mechanism, spin=speed * axis, about=about)
    else:
        made = mechanism(float(speed))
    one, state = made if isinstance(made, tuple) else (made, None)
    if n is not None and state is not None and state.v.size > MAX_DENSE:
        counted = partial(counted, n=min(2 * n + N_SPARE, state.v.size - state.rank))
    found = counted(one, state)
    turns = found.state.v[found.packed.system.bodies.v_at[:, None] + np.arange(3, 6)]
    rates = np.linalg.norm(turns, axis=1)
    if np.abs(rates - abs(speed)).min() > SPEED_RTOL * max(rates.max(), abs(speed)):
        warn(
            f"no body turns at the speed {speed:.4g} rad/s of the diagram, the fastest at "
            f"{rates.max():.4g} rad/s: its frequencies are those of another speed."
        )
    waves = None if blades is None else _waves(found, blades)
    return Modes(found.eigenvalues, found.shapes, found.scale, waves)


def _follow(one: Modes, two: Modes, order: Index) -> tuple[Index, Array]:
    """Modes of ``two`` that continue those of ``one`` in this order, and their likeness."""
    if one.eigenvalues.size != two.eigenvalues.size:
        numbers = (
            f"{one.eigenvalues.size} modes at one speed and {two.eigenvalues.size} at the next"
        )
        raise ConfigError(f"the mechanism has {numbers}: it must stay the same.")
    a, b = one.shapes[:, order] / one.scale[:, None], two.shapes / one.scale[:, None]
    sizes = np.outer(np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0))
    mac = np.abs(a.conj().T @ b) ** 2 / np.maximum(sizes, 1e-300) ** 2
    w, u = one.eigenvalues.imag[order][:, None], two.eigenvalues.imag
    change = np.abs(w - u) / np.maximum(w + u, 1e-300)
    row, column = linear_sum_assignment(mac - FREQUENCY_WEIGHT * change, maximize=True)
    return column, mac[row, column]
