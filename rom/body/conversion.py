"""A flexible body in another system of units.

Shapes are scaled so that the elastic mass matrix keeps its numbers: ``K`` stays diag(omega^2).
"""

from dataclasses import dataclass, replace

import numpy as np

from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.sampled import Sampled
from rom.body.records import Body, BodyData, Marker, Patch, Provenance
from rom.body.recovery import CENTRIFUGAL_LOADS, N_FRAME_LOADS, StressRecovery
from rom.body.stiffening import ANGULAR_LOADS, ELASTIC_LOAD, LINEAR_LOADS
from rom.errors import ConfigError, ModelError
from rom.model import BUCKLING_LOADS, Array
from rom.units import UnitSystem, unit_system

N_INTERFACE_COORDINATES = 6  # coordinates of a rigid or averaged interface: displacement, rotation
SIX = np.array([1, 1, 1, 0, 0, 0])  # powers of a length in a displacement and a rotation


@dataclass(frozen=True, slots=True)
class Factors(UnitSystem):
    """Numbers in the new units, whose name it has, per number in the old ones."""

    shape: float  # of a displacement shape, by choice: an elastic coordinate is length / shape

    @classmethod
    def between(cls, old: UnitSystem, new: UnitSystem) -> "Factors":
        """From one system to another."""
        mass = old.mass / new.mass
        return cls(new.name, old.length / new.length, mass, old.time / new.time, mass**-0.5)

    def load(self, name: str) -> float:
        """Of a load by its name in ``K_geo``."""
        if name in LINEAR_LOADS:
            return self.length / self.time**2
        if name in (*CENTRIFUGAL_LOADS, *ANGULAR_LOADS):
            return self.time**-2
        if name.startswith(ELASTIC_LOAD):
            return self.length / (self.shape * self.time**2)
        turns = name.rpartition(" ")[2].startswith("m_")
        return self.force * (self.length if turns else 1.0)


def converted(body: Body, units: str) -> Body:
    """The same body with all numbers in another unit system; itself in its own."""
    if units == body.units:
        return body
    f = Factors.between(unit_system(body.units), unit_system(units))
    L, m, t, s = f.length, f.mass, f.time, f.shape
    surface = body.surface
    if surface is not None:
        surface = replace(surface, points=surface.points * L, shape=surface.shape * s)
    return replace(
        body,
        mass=body.mass * m,
        first_moment=body.first_moment * (m * L),
        inertia=body.inertia * (m * L**2),
        S=body.S * (m * s),
        Ibar_kl=body.Ibar_kl * (m * L * s),
        S_kl=body.S_kl * (m * s**2),
        K=body.K * (m * s**2 / t**2),
        D=body.D * (m * s**2 / t),
        K_geo={load: A * (m * (s / t) ** 2 / f.load(load)) for load, A in body.K_geo.items()},
        quartic=None if body.quartic is None else _quartic(body.quartic, f),
        markers={name: _marker(body, marker, f) for name, marker in body.markers.items()},
        surface=surface,
        stress=None if body.stress is None else _stress(body.stress, f),
        omega=body.omega / t,
        units=units,
        provenance=_provenance(body.provenance, f),
    )


def _provenance(old: Provenance, f: Factors) -> Provenance:
    """With the energies to which load cases at large deflection hold, and forces that buckle."""
    found, energy = dict(old), f.force * f.length
    if cases := old.get("large deflection"):
        cases = {name: case | {"energy": case["energy"] * energy} for name, case in cases.items()}
        found["large deflection"] = cases
    if loads := old.get(BUCKLING_LOADS):
        found[BUCKLING_LOADS] = [[one, two, load * f.force] for one, two, load in loads]
    return found


def _quartic(old: Quartic | Sampled, f: Factors) -> Quartic:
    if isinstance(old, Sampled):
        raise ConfigError("sampled elements have one unit system; give their model another one.")
    energy, q = f.force * f.length, f.length / f.shape
    return Quartic(
        old.K * (energy / q**2), old.cubic * (energy / q**3), old.quartic * (energy / q**4)
    )


def _marker(body: BodyData, marker: Marker, f: Factors) -> Marker:
    rows, patch, covariance = _coordinates(body, marker, f)[:, None], marker.patch, None
    per_coordinate = np.full(body.n_modes, f.shape / f.length)
    if marker.covariance is not None:
        covariance = marker.covariance * np.r_[1.0, per_coordinate]
    if patch is not None:
        patch = Patch(
            patch.points * f.length,
            patch.surface_mass * f.length**2,
            None if patch.shapes is None else patch.shapes / f.length,
        )
    return replace(
        marker,
        point=marker.point * f.length,
        translation=marker.translation * f.shape,
        rotation=marker.rotation * (f.shape / f.length),
        hold=marker.hold * rows * np.r_[(1 / f.length) ** SIX, per_coordinate],
        patch=patch,
        covariance=covariance,
    )


def _coordinates(body: BodyData, marker: Marker, f: Factors) -> Array:
    """(n_c,) factors of the coordinates: displacements, rotations, or functions of unit norm."""
    n = marker.hold.shape[0]
    if marker.patch is not None:  # functions q with integral of q^2 = 1 have coefficients in m^2
        if marker.patch.shapes is not None:
            return np.full(n, f.length**2)
        return np.where(np.arange(n) < marker.patch.points.size, f.length, 1.0)
    if n == N_INTERFACE_COORDINATES:
        return np.asarray(f.length**SIX)
    text = f"interface {marker.name!r} of body {body.name!r} has {n} coordinates {marker.kind!r}"
    raise ModelError(f"{text} of unknown dimensions in {body.units}; make the body in SI.")


def _stress(stress: StressRecovery | CauchyRecovery, f: Factors) -> StressRecovery | CauchyRecovery:
    if isinstance(stress, CauchyRecovery):
        gradient, stiffness = stress.gradient / (f.length / f.shape), stress.stiffness * f.pressure
        return replace(
            stress, points=stress.points * f.length, gradient=gradient, stiffness=stiffness
        )
    per_coordinate, inertial = f.pressure * f.shape / f.length, stress.inertial
    if inertial is not None:
        columns = np.full(inertial.shape[1], per_coordinate * f.time**2)
        columns[:N_FRAME_LOADS] = f.pressure * f.time**2
        columns[:3] /= f.length
        inertial = inertial * columns
    return StressRecovery(stress.points * f.length, stress.operator * per_coordinate, inertial)
