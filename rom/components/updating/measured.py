"""Measured responses with their points and directions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from rom.arguments import Count, NotNegative, Number, Positive, one_each, typed, whole
from rom.body.flexible import FlexibleBody
from rom.body.surface import strain_rows, surface_of
from rom.components.updating.frf_data import FREEDOM_LOST, Complex, Noise
from rom.eigen.supports import Fixed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.names import named
from rom.rotation import skew

Measured = Literal["displacement", "velocity", "acceleration", "strain"]
DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
LENGTHS = {  # factors by which points that are off a body may all lie on it
    1e-3: "millimetres taken for metres",
    1e3: "metres taken for millimetres",
    1e-2: "centimetres taken for metres",
    0.0254: "inches taken for metres",
}
POINT_RTOL = 0.02  # distance of a sensor from the nearest point of the surface, of the body's size
SAME_RTOL = 1e-6  # distance of surfaces that touch, of the size of all
MAX_LINES_NAMED = 5  # in a message


@typed
@dataclass(frozen=True, slots=True)
class Channels:
    """Where and along which direction something is measured or driven.

    Attributes:
        points: (k, 3) points in the axes of the geometry [m].
        directions: (k, 3) directions; their length does not matter [1].
        bodies: name of the body of an assembly on which all lie, or (k,) of each; None for the
            nearest one.

    Raises:
        ConfigError: if a direction has no length, or not as many bodies are named.
    """

    points: Annotated[npt.ArrayLike, Number("m", (3,), (None, 3))]
    directions: Annotated[npt.ArrayLike, Number("1", (3,), (None, 3))]
    bodies: str | tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("points", "directions"):
            value = np.array(getattr(self, name), dtype=float, ndmin=2)
            object.__setattr__(self, name, value)
        k = len(np.asarray(self.points))
        one_each("directions", len(np.asarray(self.directions)), "points", k)
        if not np.linalg.norm(self.directions, axis=1).all():
            raise ConfigError("a direction of a channel has length zero; give one as (0, 0, 1).")
        if self.bodies is not None:
            given = (self.bodies,) * k if isinstance(self.bodies, str) else self.bodies
            one_each("names of bodies", len(given), "channels", k)
            object.__setattr__(self, "bodies", given)

    def some(self, chosen: Sequence[int] | Index) -> "Channels":
        """Those with chosen numbers (j,)."""
        bodies = None if self.bodies is None else tuple(self.bodies[k] for k in chosen)
        kept = np.array(chosen, dtype=int)
        points, directions = (np.asarray(A)[kept] for A in (self.points, self.directions))
        return Channels(points, directions, bodies)

    def _elsewhere(self, names: tuple[str, ...], what: str) -> Array:
        """(n_b, k) zero for a body on which a channel may lie, infinite for another one."""
        if self.bodies is None:
            return np.zeros((len(names), 1))
        if unknown := set(self.bodies) - set(names):
            k = next(k for k, name in enumerate(self.bodies) if name in unknown)
            known = f"of {named(names)}" if names != ("",) else "none of this body alone"
            raise ConfigError(f"{what} {k} lies on {self.bodies[k]!r}; give {known}.")
        other = np.array([[name != own for own in self.bodies] for name in names])
        return np.where(other, np.inf, 0.0)

    def owners(
        self, bodies: Mapping[str, FlexibleBody], what: str, tolerance: float | None = None
    ) -> list[str]:
        """(k,) the body on which each channel lies: that named, or the nearest one, see `rows`."""
        names, k = list(bodies), len(np.asarray(self.points))
        if len(names) == 1 and self.bodies is None:
            return names * k
        return [names[own] for own in self._placed(bodies, what, tolerance, False)[0]]

    def rows(
        self,
        body: FlexibleBody | Mapping[str, FlexibleBody],
        what: str,
        tolerance: float | None = None,
        gauges: bool | Sequence[bool] = False,
    ) -> Array:
        """(k, 6 + r) displacement [1] or strain [1/m] along each channel per coordinate.

        Args:
            body: with its outer surface; of {name: body} each channel takes the nearest one, and
                the coordinates of one body come after those of another.
            what: "sensor" or "input", for messages.
            tolerance: largest distance from a point of the surface [m]; None for two per cent of
                the size of all.
            gauges: (k,) or one for all, which measure strain in the surface [0, 1].

        Raises:
            ConfigError: if a channel is off the body, as near to two bodies, or a gauge on no face.
            ModelError: if a body carries no surface.
        """
        bodies = {"": body} if isinstance(body, FlexibleBody) else body
        strains = np.broadcast_to(gauges, len(np.asarray(self.points)))
        owners, nearest = self._placed(bodies, what, tolerance, strains)
        ends = np.cumsum([6 + one.n_modes for one in bodies.values()])
        found = np.zeros((strains.size, ends[-1]))
        each = zip(np.asarray(self.points), np.asarray(self.directions), owners, strict=True)
        for k, (x, d, own) in enumerate(each):
            part = list(bodies.values())[own]
            if strains[k]:
                motion = strain_rows(part, [x], [d], what, [k])[0]
            else:
                surface, n = surface_of(part), int(nearest[k])
                shape = surface.shape[3 * n : 3 * n + 3]
                motion = np.hstack([np.eye(3), -skew(surface.points[n]), shape])
                motion = d / np.linalg.norm(d) @ motion
            found[k, ends[own] - motion.size : ends[own]] = motion
        return found

    def _placed(
        self,
        bodies: Mapping[str, FlexibleBody],
        what: str,
        tolerance: float | None,
        gauges: npt.ArrayLike,
    ) -> tuple[Index, Index]:
        """(k,) number of the body of each channel, and (k,) of the nearest point of its surface."""
        surfaces, points = [surface_of(one) for one in bodies.values()], np.asarray(self.points)
        everywhere = np.vstack([surface.points for surface in surfaces])
        size = np.ptp(everywhere, axis=0).max()
        reach = POINT_RTOL * size if tolerance is None else tolerance
        _check_lengths(points, cKDTree(everywhere), reach, what)
        asked = [cKDTree(surface.points).query(points) for surface in surfaces]
        far, nearest = (np.array([pair[i] for pair in asked]) for i in (0, 1))
        far = far + self._elsewhere(tuple(bodies), what)
        owners, strains = far.argmin(axis=0), np.broadcast_to(gauges, len(points))
        for k, own in enumerate(owners):
            if far[own, k] > reach and not strains[k]:  # a gauge lies in a face, between nodes
                whose = "the body" if self.bodies is None else f"{self.bodies[k]!r}"
                text = f"{what} {k} at {points[k].tolist()} is {far[own, k]:.3g} m off {whose}"
                hint = "Compare the units and axes of the test with those of the geometry."
                raise ConfigError(f"{text}; {reach:.3g} m is taken.", hint=hint)
            if len(near := np.flatnonzero(far[:, k] <= far[own, k] + SAME_RTOL * size)) > 1:
                raise ConfigError(
                    f"{what} {k} at {points[k].tolist()} is as near to one as to another of "
                    f"{named(list(bodies)[j] for j in near)}.",
                    hint="Name the bodies of the channels, in a table of points by a column body, "
                    "or give points beside the joint.",
                )
        return owners, nearest[owners, np.arange(len(points))]


def _check_lengths(points: Array, surface: cKDTree, reach: float, what: str) -> None:
    """Refuse points that are off a body, or all in one spot, and on it by another unit."""
    spread, now = np.ptp(points, axis=0).max(), surface.query(points)[0]
    if (now <= reach).all() and not 0 < spread < reach:
        return
    spread = spread if len(points) > 1 else np.linalg.norm(points)
    for factor, why in LENGTHS.items():
        if factor * spread > reach and (surface.query(factor * points)[0] <= reach).all():
            k = int(now.argmax())
            raise ConfigError(
                f"{what} {k} at {points[k].tolist()} is {now[k]:.3g} m off the body; times "
                f"{factor:g} all {len(points)} of them lie on it: {why}?",
                hint="Give points in metres.",
            )


@typed
@dataclass(frozen=True, slots=True)
class Responses:
    """Measured frequency responses.

    Attributes:
        frequencies: (n_f,) lines, ascending and above zero [Hz].
        H: (n_f, n_s, n_e) response of each sensor per unit force of each input
            [m/N, m/(s N), m/(s^2 N) or 1/N].
        sensors: where they are.
        inputs: where forces act.
        coherence: (n_f, n_s, n_e) from 0 to 1, estimated with H; or one number, which is known; 0
            for a line not to be used [1].
        averages: number of averages behind H and the coherence.
        quantity: of all sensors or (n_s,) of each; "strain" is that in the surface.
        force_noise: noise on the signal of a force over the force itself, one number or (n_f, n_e)
            [1]. All sensors that were measured at the same time have the error in common that
            comes of it.
        estimator: "H1", "H2" or "Hv", which H is: its bias by the noise of forces and responses is
            taken out. None where neither is noisy enough to matter.

    Raises:
        ConfigError: if these do not fit each other, or values are not finite.
    """

    frequencies: Annotated[Array, Positive("Hz", (None,))]
    H: Complex
    sensors: Channels
    inputs: Channels
    coherence: npt.ArrayLike
    averages: Annotated[int, Count(1)]
    quantity: Measured | tuple[Measured, ...] = "displacement"
    force_noise: Annotated[npt.ArrayLike, NotNegative("1", (), (None, None))] = 0.0
    estimator: Literal["H1", "Hv", "H2"] | None = None

    def __post_init__(self) -> None:
        f = np.array(self.frequencies, dtype=float)
        object.__setattr__(self, "frequencies", f)
        object.__setattr__(self, "H", np.asarray(self.H, dtype=complex))
        if not f.size or (np.diff(f) <= 0).any():
            raise ConfigError("frequencies must ascend, and there must be one.")
        wanted = (f.size, len(np.asarray(self.sensors.points)), len(np.asarray(self.inputs.points)))
        if self.H.shape != wanted:
            raise ConfigError(f"H is {self.H.shape}, needed are lines, sensors, inputs {wanted}.")
        one_each("quantities", len(self.quantities), "sensors", wanted[1])
        c = np.asarray(self.coherence, dtype=float)
        if c.shape not in ((), wanted) or not ((c >= 0) & (c < 1)).all():
            text = f"coherence {c.shape} must be one number or {wanted}, from 0 up to below 1."
            hint = "A coherence of exactly one comes of a single average: it says nothing."
            raise ConfigError(text, hint=hint)
        if c.shape and self.averages <= FREEDOM_LOST:
            text = f"coherence estimated from {self.averages} averages says nothing of the noise"
            raise ConfigError(f"{text}; average more, or give one number that is known.")
        if (noise := np.shape(self.force_noise)) not in ((), wanted[::2]):
            raise ConfigError(f"force_noise {noise} must be a number or {wanted[::2]}.")
        self._check_values()

    def _check_values(self) -> None:
        used = self.noise.used
        bad = (~np.isfinite(self.H) | (self.H == 0)) & used
        if bad.any():
            lines = np.flatnonzero(bad.any(axis=(1, 2)))
            some = ", ".join(f"{x:.5g}" for x in self.frequencies[lines[:MAX_LINES_NAMED]])
            own = np.flatnonzero(bad.any(axis=(0, 2)))
            where = "" if own.size == len(bad[0]) else f" of sensors {named(own.tolist())}"
            text = f"H{where} is zero or not finite at {lines.size} lines, e.g. at {some} Hz"
            raise ConfigError(f"{text}; give these lines the coherence 0.")
        if used.any() and not self.H[used].imag.any():
            text = "H is real at all lines: magnitudes or real parts alone are no responses"
            raise ConfigError(f"{text}; read phases or imaginary parts too.")

    @property
    def quantities(self) -> tuple[str, ...]:
        """(n_s,) what each sensor measures."""
        one, n = self.quantity, len(np.asarray(self.sensors.points))
        return (one,) * n if isinstance(one, str) else tuple(one)

    def rows(
        self, bodies: Mapping[str, FlexibleBody], tolerance: float | None = None
    ) -> tuple[Array, Array]:
        """(n_s, 6 + r) of sensors, displacement [1] or strain [1/m], and (n_e, 6 + r) of inputs.

        Bodies and the tolerance are as of `Channels.rows`.

        Raises:
            ConfigError, ModelError: see `Channels.rows`.
        """
        gauges = [quantity == "strain" for quantity in self.quantities]
        seen = self.sensors.rows(bodies, "sensor", tolerance, gauges)
        return seen, self.inputs.rows(bodies, "input", tolerance)

    @property
    def noise(self) -> Noise:
        """Its powers."""
        c = np.maximum(np.asarray(self.coherence, dtype=float), 1e-12)
        force = np.broadcast_to(np.asarray(self.force_noise, dtype=float), self.H.shape[::2])
        incoherent = np.broadcast_to((1 - c) / c, self.H.shape)
        return Noise(incoherent, np.square(force[:, None]), self.averages, np.ndim(c) > 0)

    def logarithm(self) -> Complex:
        """(n_f, n_s, n_e) ln of displacement [m/N] or strain [1/N]; zero where H is not used.

        ConfigError: if forces are noisy and the estimator is not named, whose bias is taken
            off, or if they are noisier than the coherence allows.
        """
        s, noise = 2j * np.pi * self.frequencies[:, None, None], self.noise
        orders = np.array([DERIVATIVES.get(quantity, 0) for quantity in self.quantities])
        bias = np.where(noise.used, noise.bias(self.estimator), 0.0)
        return np.log(np.where(noise.used, self.H / s ** orders[:, None], 1.0)) - bias


@dataclass(frozen=True, slots=True)
class MeasuredModes:
    """Modes that another program found in a test.

    Attributes:
        frequencies: (m,) ascending [Hz].
        damping: (m,) ratios [1].
        points: (k, 3) where shapes are known, in the axes of the geometry [m].
        shapes: (m, k, 3) real or complex, of any scale.

    Raises:
        ConfigError: if these do not fit each other, or a shape must be finite and not zero.
    """

    frequencies: Array
    damping: Array
    points: Array
    shapes: npt.ArrayLike

    def __post_init__(self) -> None:
        m, k = len(self.frequencies), len(self.points)
        shapes = np.asarray(self.shapes)
        if shapes.shape != (m, k, 3) or np.shape(self.damping) != (m,):
            raise ConfigError(f"shapes {shapes.shape} for {m} modes, needed are ({m}, {k}, 3).")
        size = np.linalg.norm(shapes, axis=(1, 2))
        if bad := np.flatnonzero(~(np.isfinite(size) & (size > 0))).tolist():
            raise ConfigError(f"the shape of mode {bad[0] + 1} must be finite and not zero.")

    def mac(
        self, body: FlexibleBody, *, fixed: Fixed = (), n: int, tolerance: float | None = None
    ) -> Array:
        """(m, n) modal assurance criterion of measured modes and elastic ones of a body [1].

        Args:
            body: with its outer surface.
            fixed: what was held in the test, see `FlexibleBody.frequencies`.
            n: number of elastic modes.
            tolerance: see `Channels.rows` [m].

        Raises:
            ConfigError: if a point is off the body, or it has fewer modes.
            InterfaceError, ModelError: see `FlexibleBody.modes` and `Channels.rows`.

        Source:
            Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC (1982):
            |a^H b|^2 / (a^H a b^H b).
        """
        omega, Phi = body.modes(fixed=fixed)
        Phi = Phi[:, omega > 0]
        whole("n", n, 1, Phi.shape[1], reason="the elastic modes of the body")
        axes = np.tile(np.eye(3), (len(self.points), 1))
        rows = Channels(np.repeat(self.points, 3, axis=0), axes).rows(body, "point", tolerance)
        own = rows @ Phi[:, :n]
        seen = np.asarray(self.shapes).reshape(len(self.frequencies), -1)
        cross = np.abs(seen.conj() @ own) ** 2
        return cross / np.outer((np.abs(seen) ** 2).sum(axis=1), (own**2).sum(axis=0))
