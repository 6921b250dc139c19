"""The flexible body: everything a floating-frame integrator needs, independent of the mesh."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from rom.arguments import AnySolution, Between, finite, typed, whole
from rom.body.conversion import converted
from rom.body.for_motion import for_motion
from rom.body.frame import on_mean_axes, seen_from
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.sampled import Sampled
from rom.body.nonlinear.statics import critical_shares, follow
from rom.body.records import BodyData, Loads, Marker, Patch, Surface, n_rigid_motions, still_motions
from rom.body.reference import marker_motion, rigid_elastic, rigid_mass
from rom.body.rotating import rotating_frequencies
from rom.body.stiffening import SecondOrder
from rom.body.surface import Where, point_areas
from rom.eigen.supports import Fixed, Springs, spring_matrices
from rom.eigen.verbs import modes_within
from rom.errors import ConfigError, ModelError, warn
from rom.model import Array, Modes
from rom.notebook import html_table, listed, with_figure
from rom.units import unit_system

ENERGY_RTOL = 1e-6  # of states on the very edge of a range

__all__ = ["FlexibleBody", "Marker", "Patch", "Surface"]  # where pickles look for the last three


@typed
@dataclass(frozen=True)
class FlexibleBody(BodyData):
    """A reduced elastic body in its floating frame.

    A material point moves as x = r + A (X + sum_k phi_k q_k); the shapes phi contain no rigid
    motion, their reference condition says how the frame follows the body.

    Attributes:
        name: name of the body, a text of one line, see `rom.names`.
        mass: mass [kg].
        first_moment: (3,) integral of rho X [kg m].
        inertia: (3, 3) inertia about the origin of the body frame [kg m^2].
        S: (3, r) integral of rho phi_k [kg].
        Ibar_kl: (3, 3, r) entry [a, b, k] is the integral of rho X_a phi_k,b [kg m].
        S_kl: (3, 3, r, r) entry [a, b, k, l] is the integral of rho phi_k,a phi_l,b [kg].
        K: (r, r) stiffness [N/m]; the shapes are mass-normalised, so that it is diag(omega^2).
        D: (r, r) damping [N s/m].
        K_geo: (r, r) geometric stiffness per unit load, by name, see `rom.body.stiffening`.
        quartic: strain energy at large deflection, of which K is the part of second order; None
            for a body of small deflection.
        markers: interfaces by name.
        surface: outer surface, or None.
        stress: recovery of the stress on it, `StressRecovery`, at large deflection
            `CauchyRecovery`; or None.
        omega: (r,) natural frequencies of the elastic coordinates, frame held still [rad/s].
        labels: (r,) what each coordinate is.
        reference: the reference condition.
        units: declared unit system of all its numbers; mechanisms and assemblies convert to SI.
        provenance: how the body was made.
        certificate: evidence that it stands for the full model, or None.
    """

    def __repr__(self) -> str:
        kg = self.mass * unit_system(self.units).mass
        return (
            f"FlexibleBody({self.name!r}: {kg:.5g} kg, {self.n_modes} elastic coordinates, "
            f"interfaces {listed(self.markers)}, frame {self.reference})"
        )

    def _repr_html_(self) -> str:
        if self.units != "SI":
            return self.in_units("SI")._repr_html_()
        evidence = "none" if self.certificate is None else repr(self.certificate)
        centre = ", ".join(f"{x:.5g}" for x in self.first_moment / self.mass)
        lowest = ", ".join(f"{w / (2 * np.pi):.5g}" for w in self.omega[:6])
        markers = self.markers.values()
        rows = [
            ("mass [kg]", self.mass),
            ("mass centre [m]", centre),
            ("elastic coordinates", self.n_modes),
            ("their lowest frequencies [Hz]", lowest),
            ("frame", self.reference),
            ("geometric stiffness", listed(self.K_geo)),
            ("certificate", evidence),
            *((f"interface {m.name}", f"{m.kind} at {m.point.tolist()}") for m in markers),
        ]
        return with_figure(self, html_table(f"Flexible body {self.name}", ("", ""), rows))

    @property
    def interface_names(self) -> tuple[str, ...]:
        """Names of the interfaces."""
        return tuple(self.markers)

    def in_units(self, units: str) -> "FlexibleBody":
        """The same body with all its numbers in another unit system, e.g. "SI" or "mm-t-s".

        Raises:
            ConfigError: if a unit system is unknown.
            ModelError: if an interface has coordinates of unknown dimension.
        """
        return converted(self, units)

    def with_reference(self, reference: object) -> "FlexibleBody":
        """The same deformations seen from another floating frame; no finite elements involved.

        Args:
            reference: "mean-axis" (alias "free"): no linear and angular momentum relative to the
                frame; "buckens": smallest mean square of the deformation, which for small
                deformations is the same frame; the name of an interface: the frame sits on it; a
                pair of names: the frame sits on the first point, its axis runs through the second
                (pins, chord frame); three names: first point fixed, second on a line, third on a
                plane (3-2-1, simply supported).

        Raises:
            InterfaceError: if an interface is unknown.
            ModelError: if the condition leaves the frame undetermined.

        Example:
            >>> body = rom.load("beam.rom.npz")
            >>> held = body.with_reference("root")
            >>> bool(np.allclose(body.frequencies()[6:], held.frequencies()[6:]))
            True
        """
        return seen_from(self, reference)

    def on_mean_axes(self) -> "FlexibleBody":
        """The body as a mechanism integrates it, with the elastic coordinates it has.

        On mean axes displacements of second order have no momentum that shapes do not have, so that
        inertia is that of linear shapes, see `rom.mbs.kernels.second_order`. On an interface they
        contain rigid motion of the whole body. The frame of the body is kept as the marker
        `rom.model.OWN_FRAME`; a body of large deflection, or on mean axes, stays as it is.

        Raises:
            ConfigError: if an interface has the name of that marker.

        Example:
            >>> rom.load("beam.rom.npz").on_mean_axes().reference
            'mean-axis'
        """
        return on_mean_axes(self)

    def for_motion(
        self,
        motion: AnySolution,
        *,
        name: str | None = None,
        goal: Literal["stress", "deformation"] = "deformation",
        tol: Annotated[float, Between(0, 1, "()")] = 0.01,
    ) -> "FlexibleBody":
        """The body with its static shapes and the fewest modes that a motion needs.

        Modes with all interfaces held are kept in the order of what they are worth to the goal,
        whatever their frequency. Stress keeps the static share of those left out where the body
        knows it. ``provenance["for motion"]`` has the table: frequency [Hz], worth as a share of
        the goal, whether kept. `rom.certify_motion` tells how far the smaller body serves.

        Args:
            motion: of this body; also ``motion`` of a `rom.certify_motion` to which it was the
                richer one.
            name: of the body in the motion; its own if missing.
            goal: largest stress, of components on the surface, or displacement of the surface.
            tol: what all modes left out may add to the goal, over its largest value [1].

        Raises:
            ConfigError: if the motion is not one of this body, or it does not know its stress.
            ModelError: for a basis of free-free modes alone, or a body without a surface.
        """
        return for_motion(self, motion, name or self.name, goal, tol)

    def surface_areas(self, where: Where = None) -> Array:
        """(s,) area that belongs to each point of the surface, undeformed [m^2].

        Args:
            where: part of the surface, as in `rom.surface_load`; the rest has no area.

        Raises:
            ConfigError: for a place without area.
            ModelError: if the body carries no surface.
        """
        return point_areas(self, where)

    def frequencies(
        self, n: int | None = None, *, fixed: Fixed = (), springs: Springs | None = None
    ) -> Array:
        """(k,) natural frequencies of the reduced body with some interfaces held [Hz].

        Args:
            n: how many, lowest first; None for all.
            fixed: names of the interfaces held, or {name: directions}, e.g. {"root": "yz"} for one
                that slides along x, or "xyz rx ry" where it is rigid or averaged; rigid motions
                that stay free come first, as zeros.
            springs: {interface: (3,) or (6,) stiffness to the ground}, as in `rom.modes`, in units
                of the body.

        Raises:
            InterfaceError: if an interface is unknown, or has no such coordinates.
            ConfigError: for wrong directions.

        Example:
            >>> body = rom.load("beam.rom.npz")
            >>> free, held = body.frequencies(), body.frequencies(fixed=("root",))
            >>> int((free == 0.0).sum()), int((held == 0.0).sum())  # rigid motions
            (6, 0)
        """
        rate = 2 * np.pi * unit_system(self.units).time
        return self.modes(n, fixed=fixed, springs=springs)[0] / rate

    def modes(
        self, n: int | None = None, *, fixed: Fixed = (), springs: Springs | None = None
    ) -> Modes:
        """Natural modes of the reduced body: omega (m,) [rad/s], shapes (6 + r, m).

        Rows of the shapes: translation of the frame, rotation about its origin, elastic part.

        Raises:
            InterfaceError: if an interface is unknown.
            ModelError: if an interface of a basis of free-free modes alone is held.
            ConfigError: if n is no number of modes that the body has.
        """
        self.check_support(fixed)
        M, K = self.full_matrices()
        of, held = f"body {self.name!r}", self.held_rows(fixed)
        pulled = [
            (np.hstack(marker_motion(self.markers[name], self.n_modes)), k)
            for name, k in spring_matrices(springs, self.markers, of).items()
        ]
        K = K + sum(H.T @ k @ H for H, k in pulled)
        scale = np.r_[np.ones(3), np.full(3, 1 / self.size), np.ones(self.n_modes)]
        N = scale[:, None] * still_motions(held * scale)  # rigid ones first
        if n is not None:
            whole("n", n, 0, 6 + self.n_modes, reason="rigid and elastic coordinates")
        if not N.size:  # everything is held
            return Modes(np.zeros(0), N)
        lam, V = modes_within(N, K, M)
        omega = np.sqrt(np.maximum(lam, 0.0))
        pulls = [(k @ H[:, :6]) / np.abs(k).max() for H, k in pulled]
        omega[: n_rigid_motions([held[:, :6], *pulls], self.size)] = 0.0
        return Modes(omega[:n], V[:, :n])

    def effective_mass(self, *, fixed: Fixed = ()) -> Array:
        """(m, 6) share of the rigid body inertia each mode carries when its supports shake.

        Squares of phi_j^T M R; masses [kg] for the three translations, moments of inertia about
        the body origin [kg m^2] for the rotations.

        Args:
            fixed: names of the interfaces held; with all of them, effective interface masses.

        Source:
            Kammer and Triller, Selection of component modes for Craig-Bampton substructure
            representations, J. Vib. Acoust. 118 (1996) 264.
        """
        V = self.modes(fixed=fixed)[1]
        M, _ = self.full_matrices()
        return np.square(V.T @ M[:, :6])

    def rotating_frequencies(
        self,
        speed: float,
        axis: npt.ArrayLike,
        *,
        fixed: Fixed,
        at: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Array:
        """(k,) natural frequencies in a frame that rotates steadily with the supports [Hz].

        Centrifugal stiffening (``K_geo``), spin softening and Coriolis forces included.

        Args:
            speed: angular speed [rad/s].
            axis: (3,) direction of the axis of rotation, axes of the geometry [1].
            fixed: names of the interfaces that rotate with the frame; the first holds the body.
            at: (3,) a point of the axis [m].

        Raises:
            ConfigError: if no interface is held, or the axis has no direction.
            InterfaceError: if an interface is unknown.
            ModelError: for a body of large deflection, and if an interface of a basis of free-free
                modes alone is held.

        Warns:
            RomWarning: if the body has no geometric stiffness, or rotation makes it unstable.
        """
        return rotating_frequencies(self.in_units("SI"), speed, axis, fixed=fixed, at=at)

    def second_order(self) -> SecondOrder:
        """Displacements of second order that say the same as ``K_geo``.

        Raises:
            ConfigError: if a load is unknown, or a matrix is no symmetric (r, r) matrix.
        """
        return SecondOrder.of(self)

    def equilibria(
        self, loads: Loads, *, shares: npt.ArrayLike = (1.0,), fixed: Fixed = ()
    ) -> Array:
        """(s, r) elastic coordinates at rest under shares of dead loads, one after the other.

        Of a body of large deflection, whose reference interface is held. Where it snaps on the way
        the state beyond is found by arc length.

        Args:
            loads: {interface: (6,) force [N] and moment [N m]}, axes of the geometry.
            shares: (s,) of the loads, in the order in which they are reached.
            fixed: interfaces held in the mean beside the reference, or {name: directions}.

        Raises:
            ConfigError, InterfaceError: for loads that are none, or interfaces unknown.
            ModelError: if there is no stable equilibrium, or for a body of small deflection.

        Warns:
            RomWarning: of a share at which the body stores more energy than was compared.
        """
        rising, energy = finite("shares", shares, None).reshape(-1), self.energy()
        found = follow(energy, np.outer(rising, self.forces_on(loads)), self.mean_rows(fixed))
        if beyond := self.beyond_range(found):
            at = f"at {rising[beyond[0]]:.4g} of these loads: {beyond[1]}"
            warn(f"body {self.name!r} leaves the range of its certificate {at}")
        return found

    def beyond_range(self, q: Array) -> tuple[int, str] | None:
        """Which of states q (s, r) is the first beyond the certificate, and why; None if none is.

        States at large deflection that store more energy than those compared with the full model.

        Raises:
            ConfigError: if q has not r columns.
        """
        q = np.asarray(q)
        if q.ndim != 2 or q.shape[1] != self.n_modes:
            raise ConfigError(f"q of shape {q.shape} must have the shape (s, {self.n_modes}).")
        most = self.certified_energy
        energy = self.energy().energies(q) if np.isfinite(most) else np.zeros(0)
        beyond = energy > (1 + ENERGY_RTOL) * most
        if not beyond.any():
            return None
        return int(np.argmax(beyond)), (
            f"its strain energy is {np.nanmax(energy):.3g} J, and no load case of its range holds "
            f"beyond {most:.3g} J. Reduce it for larger loads, or for more shapes."
        )

    def critical_loads(self, loads: Loads, *, fixed: Fixed = ()) -> Array:
        """(k,) shares of dead loads at which a stiffness vanishes: the body buckles or snaps [1].

        Of a body of large deflection, whose reference interface is held; on its path from rest by
        arc length, in the order in which they are passed, none beyond the loads themselves.

        Args:
            loads: {interface: (6,) force [N] and moment [N m]}, axes of the geometry.
            fixed: interfaces held in the mean beside the reference, or {name: directions}.

        Raises:
            ConfigError, InterfaceError: for loads that are none, or interfaces unknown.
            ModelError: if the path does not lead to the loads, or for a body of small deflection.
        """
        return critical_shares(self.energy(), self.forces_on(loads), self.mean_rows(fixed))

    def energy(self) -> Quartic | Sampled:
        """Strain energy at large deflection.

        Raises:
            ModelError: for a body of small deflection.
        """
        if self.quartic is None:
            text = f"body {self.name!r} is one of small deflection"
            raise ModelError(f"{text}; reduce it with nonlinear=rom.Geometric(...).")
        return self.quartic

    def full_matrices(self) -> tuple[Array, Array]:
        """(6 + r, 6 + r) mass and stiffness of small motions, rigid ones first, in its units."""
        M = np.block([[rigid_mass(self), rigid_elastic(self)], [rigid_elastic(self).T, self.M]])
        K = np.zeros_like(M)
        K[6:, 6:] = self.K
        return M, K
