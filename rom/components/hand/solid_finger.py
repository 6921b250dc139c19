"""Fingers of springs whose phalanges are reduced solids: how much do bones add to the compliance?

The finger of `rom.components.hand.compliant_hand` has rigid links. Here springs are rods with the
mass of their wire and phalanges are flexible bodies; both are bodies of one mechanism, joined
rigidly at their plates. The third axis of the world points along the finger.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.body.flexible import FlexibleBody
from rom.body.reference import marker_motion
from rom.components.cosserat import Rod, body
from rom.components.cosserat.helical_spring import HelicalSpring, plate_compliance, spring_rod
from rom.components.hand.compliant_hand import check_pairs
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.linearize import linearize
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.results.state import State
from rom.model import Array

STEEL_DENSITY = 7850.0  # [kg/m^3]
ENDS = ("proximal", "distal")


def heavy_spring(spring: HelicalSpring, n: int = 16, density: float = STEEL_DENSITY) -> Rod:
    """The spring as a rod with the mass of its wire; statics as of `spring_rod`.

    The density is that of the wire [kg/m^3]; a mass m per length has the inertia of a thin tube of
    the helix: m D^2/8 about both axes across, m D^2/4 along.
    """
    wire = np.hypot(np.pi * spring.diameter * spring.coils, spring.length)
    m = density * np.pi / 4 * spring.wire**2 * wire / spring.length
    across = m * spring.diameter**2 / 8
    return spring_rod(spring, n, mass=m, inertia=(across, across, 2 * across))


def solid_finger(
    bodies: Sequence[FlexibleBody],
    springs: Sequence[HelicalSpring],
    *,
    ends: tuple[str, str] = ENDS,
    orientation: npt.ArrayLike | None = None,
    n: int = 16,
    density: float = STEEL_DENSITY,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Mechanism:
    """Springs and reduced phalanges in turn, the first spring clamped to the ground at the origin.

    Bodies are named "spring 1", "phalanx 1", "spring 2" and so on. Springs are centred on the
    markers of the phalanges.

    Args:
        bodies: a ``FlexibleBody`` per phalanx, from the palm outward.
        springs: as many.
        ends: markers of a phalanx towards the palm and towards the tip.
        orientation: (3, 3) axes of the bodies to those of the finger [1]; None for the same.
        n: segments of a spring.
        density: of the wire [kg/m^3].
        gravity: (3,) [m/s^2].

    Raises:
        ModelError: if bodies and springs do not match.
        InterfaceError: naming a marker that a phalanx does not have.
    """
    check_pairs(springs, bodies)
    A = np.eye(3) if orientation is None else np.asarray(orientation, dtype=float)
    mech = Mechanism(gravity=gravity)
    marker = mech.ground.marker((0.0, 0.0, 0.0))
    for k, (solid, spring) in enumerate(zip(bodies, springs, strict=True), start=1):
        at, along = mech.design_point(marker), np.array([0.0, 0.0, spring.length])
        joint = mech.add_nonlinear(f"spring {k}", body(heavy_spring(spring, n, density)), at=at)
        mech.fixed(f"base of spring {k}", marker, joint.marker("start"))
        corner = at + along - A @ solid.marker(ends[0]).point
        bone = mech.add_flexible(f"phalanx {k}", solid, at=corner, orientation=A)
        mech.fixed(f"base of phalanx {k}", joint.marker("end"), bone.marker(ends[0]))
        marker = bone.marker(ends[1])
    return mech


def tip_compliance(mechanism: Mechanism, marker: Marker, state: State | None = None) -> Array:
    """(6, 6) motion of a marker per load on it, world axes [m/N, rad/N m].

    Displacements, then rotations; forces, then moments. The state is at rest; None for the
    equilibrium of the mechanism.
    """
    around = linearize(mechanism, equilibrium(mechanism) if state is None else state)
    J = around.motion(marker)
    return J @ np.linalg.solve(around.K, J.T)


def link_compliance(solid: FlexibleBody, ends: tuple[str, str] = ENDS) -> Array:
    """(6, 6) motion of one marker per load on it, the other held, body axes [m/N, rad/N, rad/N/m].

    The first of both ends is held, the second one loaded.
    """
    held, loaded = (np.hstack(marker_motion(solid.marker(name), solid.n_modes)) for name in ends)
    K = solid.full_matrices()[1]
    size = np.abs(K).max()
    zero, load = np.zeros((6, 6)), np.vstack([loaded.T, np.zeros((6, 6))])
    bordered = np.block([[K / size, held.T], [held, zero]])
    return loaded @ np.linalg.solve(bordered, load)[: len(K)] / size


def parts_of_compliance(
    bodies: Sequence[FlexibleBody],
    springs: Sequence[HelicalSpring],
    *,
    ends: tuple[str, str] = ENDS,
    orientation: npt.ArrayLike | None = None,
    n: int = 16,
) -> tuple[Array, Array]:
    """(6, 6) compliance [m/N, rad/N m] of springs, and of phalanges, at a straight finger's tip.

    The compliance of parts in series is their sum, each moved to the tip: C = sum_j X_j C_j X_j^T,
    X_j = [1, -skew(s_j); 0, 1] with the way s_j from the end of the part to the tip.

    Arguments are as of `solid_finger`, world axes as of `tip_compliance`.

    Raises:
        ModelError: if bodies and springs do not match.
    """
    check_pairs(springs, bodies)
    A = np.eye(3) if orientation is None else np.asarray(orientation, dtype=float)
    turn = np.kron(np.eye(2), A)
    joints, links, arm = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(3)
    for solid, spring in zip(reversed(bodies), reversed(springs), strict=True):
        X = _moved(arm)
        links += X @ turn @ link_compliance(solid, ends) @ turn.T @ X.T
        arm = arm + A @ (solid.marker(ends[1]).point - solid.marker(ends[0]).point)
        X = _moved(arm)
        rod = spring_rod(spring, n)
        joints += X @ plate_compliance(rod, rod.x[-1]) @ X.T
        arm = arm + np.array([0.0, 0.0, spring.length])
    return joints, links


def _moved(arm: Array) -> Array:
    """(6, 6) motion at a point the way beyond another, of one solid."""
    X = np.eye(6)
    X[:3, 3:] = -rotation.skew(arm)
    return X
