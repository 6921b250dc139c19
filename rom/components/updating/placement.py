"""Where to measure and where to shake: a test is planned before it is made.

`place` chooses channels by what they tell about the parameters of a family; `independent` chooses
sensors by the modes that they tell apart. Both leave out, one after another, what costs least.

Source:
    D-optimal designs and exchange: Fedorov, Theory of optimal experiments (1972). Effective
    independence: Kammer, Sensor placement for on-orbit modal identification and correlation of
    large space structures, J. Guidance 14 (1991) 251.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from rom.arguments import NotNegative, Positive, typed, vector, whole
from rom.body.flexible import FlexibleBody
from rom.body.surface import surface_of
from rom.components.updating import family_model
from rom.components.updating.estimate import DAMPING_LOG_DEVIATION
from rom.components.updating.family_model import Attached, Family, FamilyModel, Held, Parts
from rom.components.updating.frf_data import Complex
from rom.components.updating.measured import DERIVATIVES, Channels
from rom.components.updating.methods import blocks
from rom.components.updating.models import DEAD_RATIO
from rom.components.updating.normal_equations import responses_at, sensitivity
from rom.components.updating.verdict import unseen_directions
from rom.eigen.supports import Fixed
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index
from rom.names import csv_cell
from rom.plausible import check_damping_ratio

INDEPENDENCE_RTOL = 1e-10  # smallest singular value of modes at the sensors, over the largest
MAX_EXCHANGES = 50  # rounds; three are usual
DYNAMIC_RANGE = 1e-3  # of responses that are measured at once, over the largest: 60 dB
BLOCK_VALUES = 2_000_000  # derivatives at once: 32 MB
GAIN_ATOL = 1e-9  # of the logarithm of a determinant
Error = Callable[[Complex, Array], Array]  # of responses at lines


@dataclass(frozen=True, slots=True)
class Plan:
    """Where to measure and to shake, and what the test will tell.

    Attributes:
        sensors, inputs: the chosen ones.
        sensor_numbers, input_numbers: (n_s,) and (n_e,) among the candidates.
        names: (n,) of the unknowns, damping ratios last.
        covariance: (n, n) that the logarithms of the unknowns will have [1].
        unseen: directions, {name: share [1]} in the parameters, that the data will not see.
    """

    sensors: Channels
    inputs: Channels
    sensor_numbers: Index
    input_numbers: Index
    names: tuple[str, ...]
    covariance: Array
    unseen: tuple[dict[str, float], ...]

    @property
    def deviations(self) -> dict[str, float]:
        """Relative standard deviation that each unknown will have [1]."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    def csv(self) -> str:
        """The channels as a table: kind, number, x, y, z [m], direction [1]; bodies if several."""
        rows = ["kind,number,x,y,z,dx,dy,dz" + ",body" * (self.sensors.bodies is not None)]
        for kind, channels in (("sensor", self.sensors), ("input", self.inputs)):
            d = np.asarray(channels.directions)
            unit = d / np.linalg.norm(d, axis=1, keepdims=True)
            for k, values in enumerate(np.hstack([channels.points, unit]), 1):
                own = () if channels.bodies is None else map(csv_cell, channels.bodies[k - 1 : k])
                rows.append(",".join([kind, str(k), *(f"{x:.9g}" for x in values), *own]))
        return "\n".join(rows) + "\n"

    def uff(self) -> str:
        """Data set 15 of a universal file: the points, sensors first, numbered from one [m]."""
        points = np.vstack([self.sensors.points, self.inputs.points])
        lines = [
            f"{k:10d}{0:10d}{0:10d}{1 + (k > len(self.sensor_numbers)):10d}"
            + "".join(f"{x:13.5E}" for x in point)
            for k, point in enumerate(points, 1)
        ]
        return "\n".join([f"{-1:6d}", f"{15:6d}", *lines, f"{-1:6d}"]) + "\n"

    def __str__(self) -> str:
        d = self.deviations
        lines = [f"  {name} to {100 * d[name]:.2g} %" for name in self.names]
        n_s, n_e = len(self.sensor_numbers), len(self.input_numbers)
        not_seen = [f"  not seen: {direction}" for direction in self.unseen]
        return "\n".join([f"{n_s} sensors, {n_e} inputs tell", *lines, *not_seen])


@typed
def candidates(body: FlexibleBody | Family, n: int, *, fixed: Held = ()) -> Channels:
    """Channels along three axes at each of n points spread over the surface of a body.

    Each next point is the one farthest from those before. Points that supports hold are left out.

    Args:
        body: with its outer surface; a family of bodies, or several in an assembly: all surfaces.
        n: number of points.
        fixed: what is held in the test, see `FlexibleBody.frequencies`.

    Raises:
        ConfigError: if the surface has fewer points that move.
        ModelError: if a body carries no surface.
    """
    parts = Parts.of(body)
    each = {name: surface_of(one).points for name, one in parts.bodies.items()}
    points = np.vstack(list(each.values()))
    owners = tuple(name for name, own in each.items() for _ in range(3 * len(own)))
    axes = np.tile(np.eye(3), (len(points), 1))
    everywhere = Channels(np.repeat(points, 3, axis=0), axes, None if "" in each else owners)
    nothing = np.zeros((0, parts.n))
    V = family_model.family_model(body, (nothing, nothing), {}, {}, fixed).motions
    motion = np.linalg.norm(everywhere.rows(parts.bodies, "candidate") @ V, axis=1).reshape(-1, 3)
    moving = np.flatnonzero(motion.max(axis=1) > INDEPENDENCE_RTOL * motion.max())
    whole("n", n, 1, len(moving), reason="points of the surface that move")
    points = points[moving]
    chosen, far = [0], np.full(len(points), np.inf)
    while len(chosen) < n:
        far = np.minimum(far, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(far.argmax()))
    return everywhere.some((3 * moving[chosen][:, None] + np.arange(3)).ravel())


@typed
def independent(
    body: FlexibleBody, sensors: Channels, n: int, *, modes: int, fixed: Fixed = ()
) -> tuple[Index, Array]:
    """Sensors that tell the lowest elastic modes apart: effective independence.

    The sensor whose removal keeps most of det(Phi^T Phi) goes, until n are left.

    Args:
        body: with its outer surface.
        sensors: candidates.
        n: number to keep, at least that of the modes.
        modes: number of the lowest elastic modes.
        fixed: what is held in the test, see `FlexibleBody.frequencies`.

    Returns:
        numbers (n,) of the sensors kept, ascending, and (modes, modes) the auto-MAC of the modes
        there: ones on its diagonal, small beside it [1].

    Raises:
        ConfigError: for sensors off the body, or a wrong number.
        ModelError: if the candidates do not tell the modes apart.
    """
    omega, V = body.modes(fixed=fixed)
    elastic = np.flatnonzero(omega > 0)
    whole("modes", modes, 1, elastic.size, reason="elastic modes of the body")
    Phi = sensors.rows(body, "sensor") @ V[:, elastic[:modes]]
    whole("n", n, modes, len(Phi), reason="from the number of modes to that of the candidates")
    size = np.linalg.svd(Phi, compute_uv=False)
    if size[-1] <= INDEPENDENCE_RTOL * size[0]:
        text = f"{len(Phi)} candidates do not tell {modes} modes apart"
        raise ModelError(f"{text}; offer more points or directions, or ask for fewer modes.")
    kept = np.arange(len(Phi))
    while kept.size > n:
        Q = np.linalg.qr(Phi[kept])[0]
        kept = np.delete(kept, np.square(Q).sum(axis=1).argmin())
    G = Phi[kept].T @ Phi[kept]  # squared cosines between the columns
    return kept, np.square(G) / np.outer(np.diag(G), np.diag(G))


@typed
def place(  # noqa: PLR0913  keywords of one call
    family: Family,
    sensors: Channels,
    inputs: Channels,
    frequencies: Annotated[npt.ArrayLike, Positive("Hz", (), (None,))],
    *,
    n_sensors: int,
    n_inputs: int = 1,
    noise: Annotated[float, NotNegative()] = 0.0,
    floor: Annotated[float, NotNegative()] | None = None,
    quantity: Literal["displacement", "velocity", "acceleration"] = "acceleration",
    fixed: Held = (),
    attached: Attached | None = None,
    damping: float = 0.01,
    prior: Mapping[str, Annotated[float, Positive()]] | None = None,
) -> Plan:
    """Choose the sensors and inputs that tell most about the parameters of a family.

    Most is the largest determinant of the information on the parameters when damping is unknown
    as well (D_s-optimal): inputs are added one by one while all sensors are there, sensors
    are left out one by one, and chosen ones are exchanged until no exchange gains.

    Args:
        family: from `rom.reduce_parametric`, with moduli and densities, in SI units; or several,
            as a `rom.parametric.FamilyAssembly`.
        sensors: candidates.
        inputs: candidates.
        frequencies: (n_f,) lines that will be measured [Hz].
        n_sensors: number of sensors to choose.
        n_inputs: number of inputs to choose.
        noise: standard deviation of real and imaginary part, over |H| [1].
        floor: the same where there is no response, per unit force [unit of the quantity per N];
            None for a thousandth of the largest response: 60 dB below it cables and analysers see
            themselves. Without a floor antiresonances tell more than they can.
        quantity: of all sensors.
        fixed: what will be held, see `FlexibleBody.frequencies`.
        attached: {name: `GroundSpring`, `AddedMass` or `JointSpring`} with unknown factors.
        damping: expected ratio of all modes [1].
        prior: {name: relative standard deviation [1] of its factor before the test}; without one
            the logarithm of its range.

    Raises:
        ConfigError: for channels off the body, no noise at all, wrong lines or numbers, or a
            family in other units.
        ParameterError: for a name that is taken.
        InterfaceError: if an interface is unknown.
    """
    check_damping_ratio(damping)
    bodies = Parts.of(family).bodies
    family_model.check_units(family)
    if not noise and not floor:
        raise ConfigError("noise and floor are zero, and one of them must be positive.")
    omega = 2 * np.pi * vector("frequencies", frequencies)
    rows = sensors.rows(bodies, "sensor"), inputs.rows(bodies, "input")
    whole("n_sensors", n_sensors, 1, len(rows[0]), reason="candidates")
    whole("n_inputs", n_inputs, 1, len(rows[1]), reason="candidates")
    model = family_model.family_model(family, rows, dict(attached or {}), {}, fixed)
    order = DERIVATIVES[quantity]
    if floor is None:
        floor = DYNAMIC_RANGE * _largest(model, omega, damping, order)

    def error(H: Complex, w: Array) -> Array:
        """Standard deviation (n_f, n_s, n_e) of displacement per force, both parts [m/N]."""
        return np.hypot(noise * np.abs(H), floor / w[:, None, None] ** order)

    told, known, names = _information(model, omega, damping, prior or {}, error)
    s, e = _chosen(told, known, len(model.names), n_sensors, n_inputs)
    N = known + told[np.ix_(s, e)].sum(axis=(0, 1))
    width = np.r_[np.log(model.high / model.low), np.ones(len(names) - len(model.names))]
    assumed = np.array([name in model.names and name not in (prior or {}) for name in names])
    return Plan(
        sensors=sensors.some(s),
        inputs=inputs.some(e),
        sensor_numbers=s,
        input_numbers=e,
        names=names,
        covariance=np.linalg.inv(N),
        unseen=unseen_directions(N - known * assumed, width, names),
    )


def _largest(model: FamilyModel, omega: Array, damping: float, order: int) -> float:
    """Largest response at factors of one, a derivative of this order [1/N]."""
    x = np.clip(np.zeros(len(model.names)), *model.ends)
    lines = max(1, BLOCK_VALUES // (len(model.sensors) * len(model.driven)))
    sizes = []
    for w in (omega[block] for block in blocks(omega.size, lines)):
        size = np.abs(responses_at(model, x, np.array([damping]), w)).max(axis=(1, 2))
        sizes.append((w**order * size).max())
    return float(max(sizes))


def _information(
    model: FamilyModel, omega: Array, damping: float, prior: Mapping[str, float], error: Error
) -> tuple[Array, Array, tuple[str, ...]]:
    """What each pair of channels tells (n_s, n_e, n, n), the prior (n, n), and the names (n,)."""
    family_model.check_prior(prior, model.names)
    x = np.clip(np.zeros(len(model.names)), *model.ends)
    m = model.n_ratios(x, omega.max())
    at, n = sensitivity(model, x, np.full(m, damping)), x.size + m
    n_s, n_e = len(model.sensors), len(model.driven)
    told, size = np.zeros((n_s, n_e, n, n)), np.zeros((n_s, n_e))
    lines = max(1, BLOCK_VALUES // (n_s * n_e * n))
    for w in (omega[block] for block in blocks(omega.size, lines)):
        H, J = at(w)
        J = np.moveaxis(J / error(H, w)[..., None], 0, 2)
        told += (np.swapaxes(J.conj(), 2, 3) @ J).real
        size = np.maximum(size, np.abs(H).max(axis=0))
    told[size < DEAD_RATIO * size.max()] = 0.0  # relative noise makes nothing of round-off
    width = np.log(model.high / model.low)
    sigma = np.array([prior.get(k, w) for k, w in zip(model.names, width, strict=True)])
    if not sigma.all():
        raise ConfigError("a range of one factor says nothing; give low < high or a prior.")
    known = np.diag(np.r_[sigma, np.full(m, DAMPING_LOG_DEVIATION)] ** -2.0)
    return told, known, model.labels(m)


def gain(N: Array, n_p: int) -> Array:
    """(...) ln det of the information (..., n, n) on the first n_p unknowns, the others sought."""
    return np.linalg.slogdet(N)[1] - np.linalg.slogdet(N[..., n_p:, n_p:])[1]


def _chosen(
    blocks: Array, known: Array, n_p: int, n_sensors: int, n_inputs: int
) -> tuple[Index, Index]:
    """Numbers of the sensors and of the inputs, ascending."""
    e: list[int] = []
    by_input = blocks.sum(axis=0)
    while len(e) < n_inputs:
        value = gain(known + by_input[e].sum(axis=0) + by_input, n_p)
        value[e] = -np.inf
        e.append(int(value.argmax()))
    by_sensor = blocks[:, e].sum(axis=1)
    s = _exchanged(known, by_sensor, eliminated(known, by_sensor, n_p, n_sensors), n_p)
    for _ in range(MAX_EXCHANGES):
        before = s, e
        e = _exchanged(known, blocks[s].sum(axis=0), e, n_p)
        s = _exchanged(known, blocks[:, e].sum(axis=1), s, n_p)
        if (s, e) == before:
            break
    return np.array(sorted(s)), np.array(sorted(e))


def eliminated(known: Array, blocks: Array, n_p: int, n: int) -> list[int]:
    """The n rows of information (k, q, q) that are left when those that tell least go."""
    kept = list(range(len(blocks)))
    N = known + blocks.sum(axis=0)
    while len(kept) > n:
        kept.pop(int(gain(N - blocks[kept], n_p).argmax()))
        N = known + blocks[kept].sum(axis=0)
    return kept


def _exchanged(known: Array, blocks: Array, chosen: list[int], n_p: int) -> list[int]:
    """The chosen rows after exchanges, each the best one for its place, until none gains."""
    chosen = list(chosen)
    for _ in range(MAX_EXCHANGES):
        before = chosen.copy()
        for k in range(len(chosen)):
            others = chosen[:k] + chosen[k + 1 :]
            value = gain(known + blocks[others].sum(axis=0) + blocks, n_p)
            now = value[chosen[k]]
            value[others] = -np.inf
            if value.max() > now + GAIN_ATOL:
                chosen[k] = int(value.argmax())
        if chosen == before:
            break
    return chosen
