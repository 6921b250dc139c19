"""What a flexible body consists of; the functions that make and move one take this."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.linalg import null_space
from scipy.sparse import csr_matrix

from rom.arguments import finite, typed
from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.sampled import Sampled
from rom.body.recovery import StressRecovery
from rom.eigen.supports import DIRECTIONS, Fixed, held_coordinates, supports
from rom.errors import InterfaceError, ModelError
from rom.model import Array, Index, Report
from rom.names import check_known, check_text, named

Provenance = dict[str, Any]  # JSON: how something was made
Loads = Mapping[str, npt.ArrayLike]  # {interface: (6,) force and moment [N, N m]}, axes of body
REPEATED_ROW_RTOL = 1e-7  # singular value of rows that repeat others; modes are as accurate as 1e-8


def still_motions(H: Array) -> Array:
    """(6 + r, m) basis of the motions that leave H (h, 6 + r) at rest.

    A row that repeats others counts once. Modes that do not twist a body turn its ends by their own
    error all the same, so that a twist held twice repeats itself to that error only.
    """
    if not len(H):
        return np.eye(H.shape[1])
    sizes = np.maximum(np.linalg.norm(H, axis=1, keepdims=True), 1e-300)
    return null_space(H / sizes, rcond=REPEATED_ROW_RTOL)


def n_rigid_motions(held: Iterable[Array], size: float) -> int:
    """How many of six rigid motions are left by rows (h, 6) that are held, of a size [m]."""
    rows = np.vstack([np.zeros((1, 6)), *held]) * np.r_[np.ones(3), np.full(3, 1 / size)]
    return 6 - int(np.linalg.matrix_rank(rows, tol=1e-9))


@dataclass(frozen=True, slots=True)
class Patch:
    """The meshed surface behind a deformable interface, to couple meshes that do not match."""

    points: Array  # (k, 3) undeformed nodes in the body frame [m]
    # (k, k) sparse matrix of the integrals of N_i N_j over the surface [m^2]
    surface_mass: csr_matrix
    # (3k, n_c) displacement of the nodes per unit of each interface coordinate; None when the
    # coordinates are these displacements
    shapes: Array | None = None


@dataclass(frozen=True, slots=True)
class Marker:
    """Where a joint or a force acts.

    Attributes:
        name: name of the interface.
        point: (3,) undeformed position in the body frame [m].
        translation: (3, r) displacement [m] per unit of each elastic coordinate.
        rotation: (3, r) small rotation vector per unit of each elastic coordinate [rad].
        kind: "rbe2", "rbe3", "full", or the functions it follows, e.g. "polynomial:3".
        hold: (n_c, 6 + r) interface coordinates as a function of rigid motion (translation, then
            rotation about the body origin) and elastic coordinates, in units of these; zero when it
            is held.
        patch: the surface of a deformable interface; None when its motion is rigid or averaged.
        covariance: (3, 3, 1 + r) cross-covariance of the deformed with the undeformed surface, over
            the variance of the latter [1]: without deformation, then per unit of each elastic
            coordinate. The rotation nearest to it, whatever its angle, is that of the marker.
            None for bodies of small deflection, which turn by exp(rotation q).
    """

    name: str
    point: Array
    translation: Array
    rotation: Array
    kind: str
    hold: Array
    patch: Patch | None = None
    covariance: Array | None = None


def motion_of(marker: Marker) -> Array:
    """(6, r) translation [m] and rotation [rad] of a marker per unit of each elastic coordinate."""
    return np.vstack([marker.translation, marker.rotation])


def rows_held(marker: Marker, directions: tuple[str, ...]) -> Array:
    """(h, 6 + r) rows of ``hold`` of a marker in some directions, see `rom.eigen.supports`."""
    hold = marker.hold
    return hold[held_coordinates(marker.name, marker.kind, len(hold), directions)]


@dataclass(frozen=True, slots=True)
class Surface:
    """Outer surface of the body, for pictures.

    Attributes:
        points: (s, 3) undeformed positions [m].
        triangles: (t, 3) corners.
        shape: (3 s, r) displacement per unit of each elastic coordinate; row 3*node + axis.
    """

    points: Array
    triangles: Index
    shape: Array


@typed
@dataclass(frozen=True)
class BodyData:
    """The constants of a flexible body, as `rom.FlexibleBody` explains them."""

    name: str
    mass: float
    first_moment: Array
    inertia: Array
    S: Array
    Ibar_kl: Array
    S_kl: Array
    K: Array
    D: Array
    markers: dict[str, Marker]
    omega: Array
    labels: tuple[str, ...]
    reference: str = "mean-axis"
    K_geo: dict[str, Array] = field(default_factory=dict)
    quartic: Quartic | Sampled | None = None
    surface: Surface | None = None
    stress: StressRecovery | CauchyRecovery | None = None
    units: str = "SI"
    provenance: Provenance = field(default_factory=dict)
    certificate: Report | None = None

    def __post_init__(self) -> None:
        check_text(self.name, "a body")
        for name in self.markers:
            check_text(name, "an interface")

    @property
    def M(self) -> Array:
        """(r, r) mass of the elastic coordinates [kg]."""
        return np.einsum("aakl->kl", self.S_kl)

    @property
    def n_modes(self) -> int:
        """Number r of elastic coordinates."""
        return self.K.shape[0]

    @property
    def has_static_shapes(self) -> bool:
        """False for a basis of free-free modes alone, which no joint may clamp."""
        return bool(self.provenance.get("reduction", {}).get("static shapes", True))

    def check_support(self, fixed: Fixed) -> None:
        """Refuse to hold unknown interfaces, or any of a basis of free-free modes alone."""
        held = supports(fixed, self.markers, f"body {self.name!r}")
        if held and not self.has_static_shapes:
            text = f"body {self.name!r} has free-free modes only; with {named(held)} held it is too"
            raise ModelError(f"{text} stiff: reduce with CraigBampton or Rubin.")

    def held_rows(self, fixed: Fixed) -> Array:
        """(h, 6 + r) interface coordinates that supports hold, as in `Marker.hold`."""
        held = supports(fixed, self.markers, f"body {self.name!r}")
        rows = [rows_held(self.markers[name], of) for name, of in held.items()]
        return np.vstack([np.zeros((0, 6 + self.n_modes)), *rows])

    def mean_rows(self, fixed: Fixed) -> Array:
        """(h, r) elastic part of the mean motion of interfaces in the directions that are held."""
        rows = [np.zeros((0, self.n_modes))]
        for name, directions in supports(fixed, self.markers, f"body {self.name!r}").items():
            at = [DIRECTIONS.index(d) for d in directions or DIRECTIONS]
            rows.append(motion_of(self.markers[name])[at])
        return np.vstack(rows)

    def forces_on(self, loads: Loads) -> Array:
        """(r,) forces of loads on the elastic coordinates, SI or units of the body."""
        force = np.zeros(self.n_modes)
        for name, load in loads.items():
            six, marker = finite(f"loads[{name!r}]", load, (6,)), self.marker(name)
            force += six @ motion_of(marker)
        return force

    @property
    def size(self) -> float:
        """A length that characterises the body [m]."""
        if self.surface is not None:
            return float(np.ptp(self.surface.points, axis=0).max())
        reach = [float(np.linalg.norm(marker.point)) for marker in self.markers.values()]
        return max([*reach, float(np.sqrt(np.trace(self.inertia) / self.mass))])

    def marker(self, name: str) -> Marker:
        """The marker of an interface.

        Raises:
            InterfaceError: listing the names that exist.

        Example:
            >>> float(rom.load("beam.rom.npz").marker("tip").point[0])  # the beam is 1 m long
            1.0
        """
        text = f"body {self.name!r} has no interface {name!r}; it has"
        check_known(name, self.markers, text, InterfaceError)
        return self.markers[name]

    @property
    def certified_energy(self) -> float:
        """Strain energy to which some load case at large deflection holds [J]; inf if not known."""
        cases = self.provenance.get("large deflection") or {}
        return max((case["energy"] for case in cases.values()), default=np.inf)


Body = TypeVar("Body", bound=BodyData)  # of whoever asks: a moved body is of the same class
