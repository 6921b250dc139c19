"""What a light hand weighs and bears: masses of its parts, stresses in wires, forces of motors."""

import numpy as np
import numpy.typing as npt

from rom.components.cosserat.helical_spring import HelicalSpring
from rom.components.hand.compliant_hand import Finger
from rom.components.hand.winches import motor_force
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.model import Array, Report, Row

CABLE_MASS = 1.6e-3  # of a braided steel cable of 0.7 mm [kg/m]
# tensile strength of music wire of d = 1 mm [Pa], its exponent, and the share for static torsion
WIRE_STRENGTH, WIRE_EXPONENT, TORSION_SHARE = 2211e6, 0.145, 0.45
BENDING_SHARE = 0.75  # of the tensile strength, for static bending of music wire


def mass_budget(mechanism: Mechanism, *, most: float) -> Report:
    """Masses of the parts of a moving hand, by fingers.

    All of the mechanism of `rom.components.hand.moving_hand` may weigh ``most`` [kg].
    """
    parts = mechanism.parts.values()
    names = [key.removesuffix(" joint 1") for key in mechanism.joints if key.endswith(" joint 1")]
    rows = [Row("palm [kg]", mechanism.parts["palm"].mass, "", True)]
    for name in names:
        for kind in ("spring", "phalanx"):
            found = sum(p.mass for p in parts if p.name.startswith(f"{name} {kind}"))
            rows.append(Row(f"{name}, {kind} [kg]", found, "", True))
    for name, tendon in mechanism.tendons.items():
        x = np.array([mechanism.design_point(one.marker) for one in tendon.stations])
        length = np.linalg.norm(np.diff(x, axis=0), axis=1).sum()
        rows.append(Row(f"{name} [kg]", CABLE_MASS * float(length), "", True))
    total = sum(row.value for row in rows)
    rows.append(Row("all [kg]", total, f"<= {most:g}", total <= most))
    return Report("mass of the hand", tuple(rows))


def wahl(spring: HelicalSpring) -> float:
    """Factor of the shear stress on the inner side of the coils: Wahl, Mechanical Springs, 1963."""
    C = spring.diameter / spring.wire
    return (4 * C - 1) / (4 * C - 4) + 0.615 / C


def bending_factor(spring: HelicalSpring) -> float:
    """Wahl's factor of the bending stress on the inner side: (4 C^2 - C - 1) / (4 C (C - 1))."""
    C = spring.diameter / spring.wire
    return (4 * C * C - C - 1) / (4 * C * (C - 1))


def wire_stress(
    spring: HelicalSpring, force: npt.ArrayLike, moment: npt.ArrayLike
) -> tuple[Array, Array]:
    """(...,) shear and bending stress [Pa] by forces along a spring [N] and moments across [N m].

    Source:
        Budynas, Nisbett, Shigley's Mechanical Engineering Design (2011), equations 10-7 and 10-44.
    """
    cube = np.pi * spring.wire**3
    shear = wahl(spring) * 8 * np.abs(force) * spring.diameter / cube
    return shear, bending_factor(spring) * 32 * np.abs(moment) / cube


def wire_strength(spring: HelicalSpring) -> float:
    """Tensile strength of music wire of this diameter [Pa].

    Source:
        Budynas, Nisbett, Shigley's Mechanical Engineering Design (2011), table 10-4, ASTM A228.
    """
    return WIRE_STRENGTH / (spring.wire * 1e3) ** WIRE_EXPONENT


def spring_loads(solution: Solution, name: str, k: int) -> tuple[Array, Array]:
    """(n_t,) force along spring k of a finger [N], moment across [N m], the larger of its ends."""
    ends = [_load_at(solution, f"{name} {kind} {k}") for kind in ("joint", "plate")]
    return np.maximum(ends[0][0], ends[1][0]), np.maximum(ends[0][1], ends[1][1])


def _load_at(solution: Solution, joint: str) -> tuple[Array, Array]:
    """(n_t,) force along a finger and (n_t,) moment across it at a joint, sizes [N, N m]."""
    load = solution.reaction(joint)
    marker = solution.mechanism.joints[joint].markers[1]
    axis = solution.axes(marker.body, marker)[:, :, 2]
    along = np.abs((load[:, :3] * axis).sum(axis=1))
    return along, np.linalg.norm(np.cross(axis, load[:, 3:]), axis=1)


def phalanx_stress(solution: Solution, name: str, k: int, thickness: float = 5e-3) -> float:
    """Largest bending stress of phalanx k of a finger as a bar of this radius, from its plate."""
    moment = _load_at(solution, f"{name} plate {k}")[1].max()
    return float(4 * moment / (np.pi * thickness**3))


def stress_budget(
    solution: Solution,
    fingers: dict[str, Finger],
    *,
    motor: float,
    bone: float,
    thickness: float = 5e-3,
) -> Report:
    """Largest stresses of wires and phalanges, and forces of motors, in a motion.

    Args:
        solution: motion of a moving hand.
        fingers: {name: finger} of it.
        motor: largest force of a motor [N].
        bone: strength of the phalanges [Pa].
        thickness: half that of the phalanges [m].

    Source:
        Shares of the strength: Budynas, Nisbett, Shigley's Mechanical Engineering Design (2011),
        chapter 10.
    """
    rows: list[Row] = []
    for name, finger in fingers.items():
        for k, spring in enumerate(finger.springs, start=1):
            loads = spring_loads(solution, name, k)
            shear, bending = (stress.max() for stress in wire_stress(spring, *loads))
            strength = wire_strength(spring)
            what = f"{name} spring {k}, {{}} of the wire [Pa]".format
            rows.append(_row(what("shear"), shear, TORSION_SHARE * strength))
            rows.append(_row(what("bending"), bending, BENDING_SHARE * strength))
        bones = range(1, len(finger.phalanges) + 1)
        worst = max(phalanx_stress(solution, name, k, thickness) for k in bones)
        rows.append(_row(f"{name} phalanges, bending [Pa]", worst, bone))
        if f"{name} cable" in solution.mechanism.tendons:
            rows.append(_row(f"{name} motor [N]", motor_force(solution, name).max(), motor))
    return Report("stress of the hand", tuple(rows))


def _row(quantity: str, value: float, limit: float) -> Row:
    return Row(quantity, float(value), f"<= {limit:.4g}", bool(value <= limit))
