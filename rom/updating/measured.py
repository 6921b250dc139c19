"""Measured responses with their points, directions and random errors.

Source:
    Bendat and Piersol, Random data (2010): var |H| / |H|^2 = (1 - c) / (2 n c).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from rom.arguments import finite, one_of
from rom.body.flexible import FlexibleBody
from rom.body.surface import strain_rows, surface_of
from rom.errors import ConfigError
from rom.model import Array
from rom.names import named
from rom.rotation import skew
from rom.updating.frf_data import Complex, random_error

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
LENGTHS = {  # factors by which points that are off a body may all lie on it
    1e-3: "millimetres taken for metres",
    1e3: "metres taken for millimetres",
    1e-2: "centimetres taken for metres",
    0.0254: "inches taken for metres",
}
POINT_RTOL = 0.02  # distance of a sensor from the nearest point of the surface, of the body's size
SAME_RTOL = 1e-6  # distance of surfaces that touch, of the size of all
MAX_RELATIVE_ERROR = 0.3  # of a value; beyond it the logarithm of noise is no longer normal
MAX_LINES_NAMED = 5  # in a message
FREEDOM_LOST = 2  # averages, by a variance that is estimated from the same records as the response
MIN_OWN_SHARE = 0.1  # of the variance of a response that is left to its sensor


@dataclass(frozen=True, slots=True)
class Channels:
    """Where and along which direction something is measured or driven.

    Attributes:
        points: (k, 3) points in the axes of the geometry [m].
        directions: (k, 3) directions; their length does not matter [1].

    Raises:
        ConfigError: unless both are k rows of three numbers, and all directions have a length.
    """

    points: npt.ArrayLike
    directions: npt.ArrayLike

    def __post_init__(self) -> None:
        for name in ("points", "directions"):
            value = np.atleast_2d(finite(name, getattr(self, name), None))
            object.__setattr__(self, name, value)
        shapes = np.shape(self.points), np.shape(self.directions)
        if shapes[0] != shapes[1] or len(shapes[0]) != 2 or shapes[0][1] != 3:
            raise ConfigError(f"points {shapes[0]}, directions {shapes[1]}: (k, 3) of both.")
        if not np.linalg.norm(self.directions, axis=1).all():
            raise ConfigError("a channel has a direction of length zero.")

    def rows(
        self,
        body: FlexibleBody | Mapping[str, FlexibleBody],
        what: str,
        tolerance: float | None = None,
        gauges: npt.ArrayLike = False,
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
        surfaces, points = [surface_of(one) for one in bodies.values()], np.asarray(self.points)
        everywhere = np.vstack([surface.points for surface in surfaces])
        size = np.ptp(everywhere, axis=0).max()
        reach = POINT_RTOL * size if tolerance is None else tolerance
        _check_lengths(points, cKDTree(everywhere), reach, what)
        asked = [cKDTree(surface.points).query(points) for surface in surfaces]
        far, nearest = (np.array([pair[i] for pair in asked]) for i in (0, 1))
        ends = np.cumsum([6 + one.n_modes for one in bodies.values()])
        found, strains = np.zeros((len(points), ends[-1])), np.broadcast_to(gauges, len(points))
        for k, d in enumerate(np.asarray(self.directions)):
            own = int(far[:, k].argmin())
            if far[own, k] > reach and not strains[k]:  # a gauge lies in a face, between nodes
                raise ConfigError(
                    f"{what} {k} at {points[k].tolist()} is {far[own, k]:.3g} m off the body; "
                    f"{reach:.3g} m is taken.",
                    hint="Compare the units and axes of the test with those of the geometry.",
                )
            if len(near := np.flatnonzero(far[:, k] <= far[own, k] + SAME_RTOL * size)) > 1:
                raise ConfigError(
                    f"{what} {k} at {points[k].tolist()} is as near to one as to another of "
                    f"{named(list(bodies)[j] for j in near)}.",
                    hint="Give a point of the body that is meant, beside its joint.",
                )
            surface, n = surfaces[own], int(nearest[own, k])
            if strains[k]:
                part = list(bodies.values())[own]
                elastic = strain_rows(part, points[[k]], [d], what, [k])[0]
                found[k, ends[own] - elastic.size : ends[own]] = elastic
                continue
            shape = surface.shape[3 * n : 3 * n + 3]
            motion = np.hstack([np.eye(3), -skew(surface.points[n]), shape])
            found[k, ends[own] - motion.shape[1] : ends[own]] = d / np.linalg.norm(d) @ motion
        return found


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
        quantity: "displacement", "velocity", "acceleration" or "strain" in the surface, of all
            sensors or (n_s,) of each.
        force_noise: noise on the signal of a force over the force itself [1]. All sensors that were
            measured at the same time have the error in common that comes of it.

    Raises:
        ConfigError: if these do not fit each other, or values are not finite.
    """

    frequencies: Array
    H: Complex
    sensors: Channels
    inputs: Channels
    coherence: Any
    averages: int
    quantity: str | tuple[str, ...] = "displacement"
    force_noise: float = 0.0

    def __post_init__(self) -> None:
        f = finite("frequencies", self.frequencies, None)
        object.__setattr__(self, "frequencies", f)
        object.__setattr__(self, "H", np.asarray(self.H, dtype=complex))
        for one in self.quantities:
            one_of("quantity", one, (*DERIVATIVES, "strain"))
        if f.ndim != 1 or not f.size or f[0] <= 0 or (np.diff(f) <= 0).any():
            raise ConfigError("frequencies must ascend and lie above zero.")
        wanted = (f.size, len(np.asarray(self.sensors.points)), len(np.asarray(self.inputs.points)))
        if self.H.shape != wanted:
            raise ConfigError(
                f"H is {self.H.shape}; lines, sensors and inputs are {wanted}.",
            )
        if len(self.quantities) != wanted[1]:
            raise ConfigError(f"{len(self.quantities)} quantities of {wanted[1]} sensors.")
        c = np.asarray(self.coherence, dtype=float)
        if c.shape not in ((), wanted) or not ((c >= 0) & (c < 1)).all():
            raise ConfigError(
                f"coherence {c.shape} must be one number or {wanted}, from 0 up to below 1.",
                hint="A coherence of exactly one comes of a single average: it says nothing.",
            )
        random_error(0.5, self.averages)
        if c.shape and self.averages <= FREEDOM_LOST:
            raise ConfigError(
                f"coherence estimated from {self.averages} averages says nothing of the noise.",
                hint="Average more, or give one number that is known.",
            )
        if not finite("force_noise", self.force_noise, ()) >= 0:
            raise ConfigError(f"force_noise = {self.force_noise}: zero or more.")
        self._check_values()

    def _check_values(self) -> None:
        used = self.relative_error() <= MAX_RELATIVE_ERROR
        bad = (~np.isfinite(self.H) | (self.H == 0)) & used
        if bad.any():
            lines = np.flatnonzero(bad.any(axis=(1, 2)))
            some = ", ".join(f"{x:.5g}" for x in self.frequencies[lines[:MAX_LINES_NAMED]])
            own = np.flatnonzero(bad.any(axis=(0, 2)))
            where = "" if own.size == len(bad[0]) else f" of sensors {named(own.tolist())}"
            raise ConfigError(
                f"H{where} is zero or not finite at {lines.size} lines, e.g. at {some} Hz.",
                hint="Give these lines the coherence 0.",
            )

    @property
    def quantities(self) -> tuple[str, ...]:
        """(n_s,) what each sensor measures."""
        one, n = self.quantity, len(np.asarray(self.sensors.points))
        return (one,) * n if isinstance(one, str) else tuple(one)

    def rows(
        self, bodies: Mapping[str, FlexibleBody], tolerance: float | None = None
    ) -> tuple[Array, Array]:
        """(n_s, 6 + r) of sensors, displacement [1] or strain [1/m], and (n_e, 6 + r) of inputs.

        Args:
            bodies: see `Channels.rows`.
            tolerance: see `Channels.rows` [m].

        Raises:
            ConfigError, ModelError: see `Channels.rows`.
        """
        gauges = [quantity == "strain" for quantity in self.quantities]
        return (
            self.sensors.rows(bodies, "sensor", tolerance, gauges),
            self.inputs.rows(bodies, "input", tolerance),
        )

    def relative_error(self) -> Array:
        """(n_f, n_s, n_e) standard deviation of real and imaginary part, over |H| [1].

        Squared residuals over estimated variances have the mean n / (n - 2) for n averages.

        Source:
            Bendat and Piersol, Random data, F-distribution of 2 and 2 n - 2 freedoms.
        """
        c = np.maximum(np.asarray(self.coherence, dtype=float), 1e-12)
        n = self.averages - FREEDOM_LOST * bool(c.ndim)
        return np.broadcast_to(random_error(c, n), self.H.shape)

    def errors(self) -> tuple[Array, float]:
        """Of ln H: (n_f, n_s, n_e) errors of the sensors, and the one that they have in common [1].

        The first is infinite where a value is not used. Of circular errors with the variance
        s^2 in each part the logarithm has s^2 (1 + s^2 + ...). An estimated variance v of n
        averages varies by v^2 / (n - 1); what is left of it without the common part varies as
        much, so that one over it is too large by (v / left)^2 / (n - 2), to first order.
        """
        error, n = self.relative_error(), self.averages
        common = self.force_noise / np.sqrt(2 * n)
        estimated = np.ndim(self.coherence) > 0
        total = error**2 * ((n - FREEDOM_LOST) / (n - 1) if estimated else 1.0)
        least = MIN_OWN_SHARE * total
        own = np.maximum(total - common**2, least)
        if estimated:
            varied = (total / own) ** 2 / (n - FREEDOM_LOST)
            own = own * (1 + np.where(own > least, varied, 0.0))
        used = error <= MAX_RELATIVE_ERROR
        return np.sqrt(np.where(used, own * (1 + error**2), np.inf)), common

    def logarithm(self) -> Complex:
        """(n_f, n_s, n_e) ln of displacement [m/N] or strain [1/N]; zero where H is not used."""
        s = 2j * np.pi * self.frequencies[:, None, None]
        used = self.relative_error() <= MAX_RELATIVE_ERROR
        orders = np.array([DERIVATIVES.get(quantity, 0) for quantity in self.quantities])
        return np.log(np.where(used, self.H / s ** orders[:, None], 1.0))


@dataclass(frozen=True, slots=True)
class MeasuredModes:
    """Modes that another program found in a test.

    Attributes:
        frequencies: (m,) ascending [Hz].
        damping: (m,) ratios [1].
        points: (k, 3) where shapes are known, in the axes of the geometry [m].
        shapes: (m, k, 3) real or complex, of any scale.

    Raises:
        ConfigError: if these do not fit each other, or a shape is zero or not finite.
    """

    frequencies: Array
    damping: Array
    points: Array
    shapes: Any

    def __post_init__(self) -> None:
        m, k = len(self.frequencies), len(self.points)
        shapes = np.asarray(self.shapes)
        if shapes.shape != (m, k, 3) or np.shape(self.damping) != (m,):
            raise ConfigError(f"shapes {shapes.shape} for {m} modes at {k} points: ({m}, {k}, 3).")
        size = np.linalg.norm(shapes, axis=(1, 2))
        if bad := np.flatnonzero(~(np.isfinite(size) & (size > 0))).tolist():
            raise ConfigError(f"the shape of mode {bad[0] + 1} is zero or not finite.")

    def mac(
        self, body: FlexibleBody, *, fixed: Any = (), n: int, tolerance: float | None = None
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
        if not 1 <= n <= Phi.shape[1]:
            raise ConfigError(f"n = {n}: the body has {Phi.shape[1]} elastic modes.")
        axes = np.tile(np.eye(3), (len(self.points), 1))
        rows = Channels(np.repeat(self.points, 3, axis=0), axes).rows(body, "point", tolerance)
        own = rows @ Phi[:, :n]
        seen = np.asarray(self.shapes).reshape(len(self.frequencies), -1)
        cross = np.abs(seen.conj() @ own) ** 2
        return cross / np.outer((np.abs(seen) ** 2).sum(axis=1), (own**2).sum(axis=0))
