"""Bodies of a mechanism with their start position, and the markers on them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rom import rotation
from rom.arguments import finite, typed
from rom.errors import ConfigError, ModelError
from rom.model import OWN_FRAME, Array
from rom.names import check_known
from rom.notebook import listed
from rom.plausible import GYRATION, SIZE, warn_outside

GROUND = "ground"
# smallest over largest eigenvalue of the scaled mass matrix below which a body counts as singular
SINGULAR_MASS = 1e-11
SPIN_RTOL = 1e-6  # of an axis, from that about which a body spins, and of a marker on it
MESHED_RTOL = 1e-3  # the same of a meshed body: gear shafts of 4000 nodes miss 4e-6
SURFACE_PREFIX = "surface point "  # markers that a contact puts on the surface of a flexible body


def surface_place(k: int) -> str:
    """Place of the marker on point k of the surface of a flexible body; it does not turn."""
    return f"{SURFACE_PREFIX}{k}"


@dataclass(frozen=True, slots=True)
class Marker:
    """A point on a body: a name, or three coordinates in the body frame [m]."""

    body: str
    place: str | tuple[float, float, float]


@typed
@dataclass(frozen=True)
class Part:
    """A body in a mechanism.

    Attributes:
        name: name of the body.
        mass: [kg].
        first: (3,) first moment about the origin of the frame [kg m].
        second: (3, 3) integral of rho X X^T [kg m^2].
        at, p: (3,), (4,) origin [m] and quaternion [1] of the frame at the start.
        velocity, omega: (3,), (3,) of the frame at the start; world, body frame [m/s, rad/s].
        points: {name: (3,) point of a rigid body, body frame [m]}.
        flexible: the ``FlexibleBody``, None for a rigid body.
        moving: the same as it is integrated, see `FlexibleBody.on_mean_axes`.
        q, qd: (r,) elastic coordinates and rates at the start, in the units of the body's shapes.
        spin: (3,) angular velocity of the material through the frame, body frame [rad/s].
    """

    name: str
    mass: float
    first: Array
    second: Array
    at: Array
    p: Array
    velocity: Array
    omega: Array
    points: dict[str, Array] = field(default_factory=dict)
    flexible: Any = None
    moving: Any = None
    q: Array = field(default_factory=lambda: np.zeros(0))
    qd: Array = field(default_factory=lambda: np.zeros(0))
    spin: Array = field(default_factory=lambda: np.zeros(3))

    def __repr__(self) -> str:
        kind = f"flexible, {self.r} elastic coordinates" if self.flexible is not None else "rigid"
        return f"Part({self.name!r}: {kind}, {self.mass:.5g} kg, markers {listed(self.names)})"

    @property
    def r(self) -> int:
        """Number of elastic coordinates."""
        return self.q.size

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the markers."""
        return tuple(self.points if self.flexible is None else self.flexible.markers)

    def marker(self, place: Any) -> Marker:
        """Handle of a named marker, or of a point (3,) in the body frame.

        Raises:
            ConfigError: if the name is unknown, or for a free point on a flexible body, where
                only the interfaces have known deformations.

        Example:
            >>> mech = rom.Mechanism()
            >>> beam = mech.add_flexible("beam", rom.load("beam.rom.npz"), at=(2, 0, 0))
            >>> float(mech.design_point(beam.marker("tip"))[0])  # 1 m long, from x = 2
            3.0
        """
        if isinstance(place, str):
            check_known(place, self.names, f"body {self.name!r} has no marker {place!r}; it has")
            return Marker(self.name, place)
        if self.flexible is not None:
            raise ConfigError(f"{self.name!r} is flexible; use its markers {sorted(self.names)}.")
        point = finite(f"marker of {self.name}", place, (3,))
        return Marker(self.name, (float(point[0]), float(point[1]), float(point[2])))

    def point(self, marker: Marker) -> Array:
        """(3,) undeformed position of a marker in the body frame [m]."""
        row = self._surface_row(marker.place)
        if row is not None:
            return np.asarray(self.flexible.surface.points[row], dtype=float)
        if marker == self.own_frame:
            return np.zeros(3)
        self.marker(marker.place)
        if not isinstance(marker.place, str):
            return np.array(marker.place)
        if self.flexible is None:
            return self.points[marker.place]
        return np.asarray(self.flexible.markers[marker.place].point, dtype=float)

    def spin_about(self, name: str, axis: Array) -> float:
        """Angular velocity of the material through the frame about an axis (3,) of it [rad/s].

        Raises:
            ConfigError: naming the element that asks, if the body spins about another axis.
        """
        speed = float(axis @ self.spin)
        if np.linalg.norm(self.spin - speed * axis) > SPIN_RTOL * np.linalg.norm(self.spin):
            text = f"body {self.name!r} spins about {self.spin.tolist()} rad/s, and the axis of"
            raise ConfigError(
                f"{text} {name!r} is {axis.round(9).tolist()} in it: both must be one."
            )
        return speed

    def refuse_spin(self, what: str, why: str) -> None:
        """Refuse a body that spins, for what knows nothing of it, and say why."""
        if self.spin.any():
            text = f"{what} is of body {self.name!r}, which spins in its frame: {why}"
            raise ConfigError(f"{text}; give omega instead of spin.")

    def check_on_axis(self, name: str, marker: Marker) -> None:
        """Let nothing, by name, hold a body that spins at a point beside its axis.

        Raises:
            ModelError: if the marker lies beside the axis through the mass centre.
        """
        speed = float(np.linalg.norm(self.spin))
        if not speed or self._surface_row(marker.place) is not None:
            return
        arm = self.point(marker) - self.first / self.mass
        apart = float(np.linalg.norm(np.cross(self.spin, arm))) / speed
        size = np.sqrt(np.trace(self.second) / self.mass)
        if apart > (SPIN_RTOL if self.flexible is None else MESHED_RTOL) * size:
            text = f"marker {marker.place!r} of body {self.name!r} lies {apart:.4g} m"
            why = f"an unbalance of {self.mass * apart:.4g} kg m that {name!r} holds"
            cure = f"or let a force of {self.mass * apart * speed**2:.4g} N at this speed turn"
            hint = f"Let its frame turn: give omega instead of spin, {cure}."
            raise ModelError(f"{text} beside the axis, {why}.", where=self.name, hint=hint)

    @property
    def own_frame(self) -> Marker | None:
        """Marker that is the frame of the body, where its motion is that of another frame."""
        return None if self.moving is self.flexible else Marker(self.name, OWN_FRAME)

    def shapes(self, marker: Marker) -> tuple[Array, Array]:
        """(3, r) displacement [m] and (3, r) rotation [rad] of a marker per elastic coordinate."""
        if self.flexible is None:
            return np.zeros((3, 0)), np.zeros((3, 0))
        row = self._surface_row(marker.place)
        if row is not None:
            shape = np.asarray(self.moving.surface.shape, dtype=float)
            return shape[3 * row : 3 * row + 3], np.zeros((3, self.r))
        m = self.moving.markers[marker.place]
        return np.asarray(m.translation, dtype=float), np.asarray(m.rotation, dtype=float)

    def covariance(self, marker: Marker) -> Array | None:
        """(3, 3, 1 + r) from which a marker has its rotation [1], None if it turns by exp."""
        if self.flexible is None or marker.place not in self.moving.markers:
            return None
        found = getattr(self.moving.markers[marker.place], "covariance", None)
        return None if found is None else np.asarray(found, dtype=float)

    def _surface_row(self, place: object) -> int | None:
        """Point of the surface that a contact has put a marker on, or None."""
        if self.flexible is None or not isinstance(place, str) or place in self.names:
            return None
        return int(place.removeprefix(SURFACE_PREFIX)) if place.startswith(SURFACE_PREFIX) else None


def ground_part() -> Part:
    """The body that never moves, its frame the world."""
    zero, still = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    return Part(GROUND, 0.0, zero, np.zeros((3, 3)), zero, still, zero, zero)


def rigid_part(name: str, mass: float, inertia: Array, pose: Any, points: dict[str, Array]) -> Part:
    """A rigid body, if some distribution of mass has this inertia."""
    size = np.abs(inertia).max()
    moments = np.linalg.eigvalsh(0.5 * (inertia + inertia.T))
    fault = ""
    if np.abs(inertia - inertia.T).max() > 1e-9 * size or moments[0] <= 0.0:
        fault = "it must be symmetric and positive definite"
    elif moments[2] > (1 + 1e-6) * (moments[0] + moments[1]):
        fault = "the largest must be at most the sum of the others; no body has this inertia"
    if fault:
        text = f"inertia has principal moments {moments.tolist()} kg m^2: {fault}."
        raise ModelError(text, where=name)
    reach = max((float(np.linalg.norm(x)) for x in points.values()), default=0.0)
    radius = float(np.sqrt(moments[2] / mass))
    if reach > 0.0:  # a marker in the mass centre says nothing
        sizes = f"body {name!r}, {radius:.4g} m over {reach:.4g} m,"
        warn_outside(GYRATION, radius / reach, sizes)
    else:
        warn_outside(SIZE, radius, f"body {name!r} by its inertia")
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    at, p, velocity, omega = pose
    return Part(name, mass, np.zeros(3), second, at, p, velocity, omega, points)


def flexible_part(name: str, body: Any, moving: Any, pose: Any, elastic: Any) -> Part:
    """A flexible body, integrated as the body ``moving``, if its mass matrix is regular."""
    inertia = np.asarray(body.inertia, dtype=float)
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    first = np.asarray(body.first_moment, dtype=float)
    at, p, velocity, omega = pose
    still = name, float(body.mass), first, second, at, p
    part = Part(*still, velocity, omega, {}, body, moving, *elastic)
    M = mass_at_rest(part)
    if not np.isfinite(M).all() or np.diag(M).min() <= 0.0:
        text = "the mass matrix must be finite, with a positive diagonal; rom.check says more."
        raise ModelError(text, where=part.name)
    scale = 1 / np.sqrt(np.diag(M))
    spectrum = np.linalg.eigvalsh(M * scale * scale[:, None])
    if spectrum[0] < SINGULAR_MASS * spectrum[-1]:
        text = f"the mass matrix of the frame and the {part.r} elastic coordinates is singular"
        ratio = f"(eigenvalue ratio {spectrum[0] / spectrum[-1]:.2g})"
        hint = "Give the body a reference condition: body.with_reference('mean-axis')."
        raise ModelError(f"{text} {ratio}: it moves rigidly.", where=part.name, hint=hint)
    return part


def moving_start(part: Part) -> tuple[Array, Array]:
    """(7 + r,) coordinates and (6 + r,) velocities at the start, of the frame that is integrated.

    Its origin and axes are those of the frame of the body without what the deformation adds.
    """
    at, p, velocity, omega = part.at, part.p, part.velocity, part.omega
    if part.own_frame and (part.q.any() or part.qd.any()):
        marker = part.moving.markers[OWN_FRAME]
        bend = part.moving.second_order().markers[OWN_FRAME]
        move = np.vstack([marker.translation, marker.rotation])
        shift, theta = np.split((move + 0.5 * bend @ part.q) @ part.q, 2)
        slip, rate = np.split((move + bend @ part.q) @ part.qd, 2)
        p = rotation.multiply(part.p, rotation.exp(-theta))
        A = rotation.matrix(p)
        omega = rotation.matrix(rotation.exp(theta)) @ part.omega
        omega = omega - rotation.spatial_tangent(theta) @ rate
        at = part.at - A @ shift
        velocity = part.velocity - A @ (np.cross(omega, shift) + slip)
    return np.r_[at, p, part.q], np.r_[velocity, omega, part.qd]


def mass_at_rest(part: Part) -> Array:
    """(6 + r, 6 + r) mass matrix of the undeformed body in its frame."""
    d = rotation.skew(part.first)
    J = np.trace(part.second) * np.eye(3) - part.second
    rigid = np.block([[part.mass * np.eye(3), -d], [d, J]])
    if part.flexible is None:
        return rigid
    Cr = rotation.crossed(np.asarray(part.moving.Ibar_kl))
    coupling = np.vstack([np.asarray(part.moving.S), Cr])
    return np.block([[rigid, coupling], [coupling.T, np.asarray(part.moving.M)]])
