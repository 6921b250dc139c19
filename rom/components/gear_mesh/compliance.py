"""Compliance of gear teeth: closed forms for bending, foundation and contact.

Source:
    Weber and Banaschek, VDI-Bericht 1953 (plane strain, nu = 0.3 in the numbers); Sainsot, Velex
    and Duverger, J. Mech. Des. 126 (2004), for the body; ISO 6336-1 for the whole.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.integrate import trapezoid

from rom.arguments import between
from rom.components.gear_mesh.gears.geometry import GearPair, involute
from rom.components.gear_mesh.gears.hertz import Hertz
from rom.errors import ModelError
from rom.model import Array

Body = Literal["weber", "sainsot"]
RIM_COEFFICIENTS = {  # A, B, C, D, E, F of L, M, P, Q
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}


def profile(pair: GearPair, gear: int, n: int = 2001) -> tuple[Array, Array]:
    """Height over the centre of the wheel and thickness of a tooth, from root to tip [m].

    Radial below the base circle, with as much of the fillet as fits there.
    """
    rb, rf = pair.rb[gear], pair.rf[gear]
    radius = np.linspace(rf, pair.ra[gear], n)
    half = _half_angle(pair, gear, radius)
    x, rho = radius * np.sin(half), min(pair.fillet * pair.module, max(rb - rf, 0.0))
    if rho > 0:
        below = np.clip(rho - (radius - rf), 0.0, None)
        x = x + np.where(below > 0, rho - np.sqrt(np.clip(rho**2 - below**2, 0.0, None)), 0.0)
    return radius * np.cos(half), 2 * x


def tooth_compliance(
    pair: GearPair, gear: int, radius: float, body: Body = "weber", *, bore: float = 0.35
) -> tuple[float, float, float]:
    """E times the deflection per force and width along the line of action, without contact.

    Args:
        pair: spur gears.
        gear: 0 for the pinion, 1 for the gear.
        radius: where the tooth is loaded [m].
        body: foundation of Weber, or of Sainsot with a body clamped at its bore.
        bore: diameter of the bore over that of the reference circle [1].

    Returns:
        bending with shear and compression [1], foundation [1], depth [m] from the flank to the axis
        of the tooth along the normal.

    Raises:
        ModelError: if the tooth has no such radius.
    """
    ends = float(pair.rb[gear]), float(pair.ra[gear] * (1 + 1e-12))
    between("radius on the involute", radius, *ends, error=ModelError)
    y, t = profile(pair, gear)
    half = float(_half_angle(pair, gear, np.array([radius]))[0])
    gamma = float(np.arccos(min(pair.rb[gear] / radius, 1.0))) - half
    height, tan2 = pair.rb[gear] / np.cos(gamma), np.tan(gamma) ** 2
    k, u = y <= height, height - y[0]
    bending = 10.92 * trapezoid((height - y[k]) ** 2 / t[k] ** 3, y[k])
    bending += 3.1 * (1 + 0.294 * tan2) * trapezoid(1 / t[k], y[k])
    foundation = 5.2 * (u / t[0]) ** 2 + u / t[0] + 1.4 * (1 + 0.294 * tan2)
    if body != "weber":
        foundation = _sainsot(pair, gear, t[0], u, tan2, bore)
    cos2 = np.cos(gamma) ** 2
    return float(cos2 * bending), float(cos2 * foundation), radius * np.sin(half) / np.cos(gamma)


def contact_compliance(
    radii: npt.ArrayLike, depths: npt.ArrayLike, force: float, E: float
) -> float:
    """E times the approach of two teeth per force and width [1]; line contact after Weber.

    Radii of curvature and depths from the flanks to the axes of the teeth are (2,) [m], the force
    is per length of contact line [N/m], E is that of both [Pa]; nu is 0.3.
    """
    rho, h, nu = np.asarray(radii, dtype=float), np.asarray(depths, dtype=float), 0.3
    a2 = 8 * force * (1 - nu**2) * rho.prod() / rho.sum() / (np.pi * E)
    return float((1 - nu**2) / np.pi * (np.log(4 * h**2 / a2).sum() - 2 * nu / (1 - nu)))


def normal_section(pair: GearPair) -> GearPair:
    """Spur gears with the teeth that a helical pair has in the section normal to them.

    They have z / (cos^2 beta_b cos beta) teeth, which need not be a whole number.

    Source:
        ISO 6336-1 and ISO 21771: virtual spur gears.
    """
    if not isinstance(pair, GearPair) or pair.internal:
        raise ModelError("compliances of racks and internal teeth are not known; give numbers.")
    if pair.helix == 0.0:
        return pair
    teeth = _virtual_teeth(pair)
    return replace(pair, teeth=teeth, helix=0.0, centre_distance=None, thinning=0.0)


def _virtual_teeth(pair: GearPair) -> tuple[float, float]:
    """Their numbers on the virtual spur gears."""
    first, second = (z / (np.cos(pair.base_helix) ** 2 * np.cos(pair.helix)) for z in pair.teeth)
    return first, second


def in_normal_section(pair: GearPair, s: float) -> tuple[Array, Array]:
    """Where teeth that touch at s from T1 do so in their normal section, on the virtual gears.

    (2,) radii of equal height over the reference circles, (2,) radii of curvature [m].
    """
    rho = np.array([s, pair.tangents - s])
    height, normal = np.hypot(pair.rb, rho) - pair.r, normal_section(pair)
    return np.maximum(normal.r + height, normal.rb), rho / np.cos(pair.base_helix)


def pair_stiffness(
    pair: GearPair, s: float, *, force: float, E: float = 206e9, body: Body = "weber"
) -> float:
    """Stiffness of one pair of teeth per length of contact line, along its normal [N/m^2].

    Helical teeth bend as those of their normal section. Times the cosine of the base helix it is
    the stiffness per width in the transverse plane, as ISO 6336 has it.

    Args:
        pair: spur or helical gears.
        s: place on the path of contact, from T1 [m].
        force: normal force per length of contact line [N/m].
        E: Young's modulus [Pa].
        body: see `tooth_compliance`.

    Raises:
        ModelError: if the pair does not touch there.
    """
    own, depths, rho = _both_teeth(pair, s, body)
    return float(E / (own + contact_compliance(rho, depths, force, E)))


def _both_teeth(pair: GearPair, s: float, body: Body) -> tuple[float, list[float], Array]:
    """E times what both teeth give way without contact; depths, and radii of curvature [m]."""
    (radii, rho), teeth = in_normal_section(pair, s), normal_section(pair)
    parts = [tooth_compliance(teeth, g, float(radii[g]), body) for g in (0, 1)]
    own = sum(bending + foundation for bending, foundation, _ in parts)
    return own, [depth for _, _, depth in parts], rho


def places_of_contact(pair: GearPair, n: int) -> Array:
    """(n,) from first to last contact, both of which are inside [m]."""
    A, B = pair.path
    return np.linspace(A + 1e-9 * (B - A), B - 1e-9 * (B - A), n)


def stiffness_table(
    pair: GearPair, *, force: float, n: int = 41, E: float = 206e9, body: Body = "weber"
) -> Array:
    """(n,) stiffness of one pair from first to last contact [N/m^2]; see `pair_stiffness`.

    Raises:
        ModelError: as `pair_stiffness`.
    """
    places = places_of_contact(pair, n)
    return np.array([pair_stiffness(pair, s, force=force, E=E, body=body) for s in places])


def bending_table(
    pair: GearPair, *, n: int = 41, E: float = 206e9, nu: float = 0.3, body: Body = "weber"
) -> tuple[Array, Hertz]:
    """(n,) stiffness [N/m^2] of one pair without its contact, and the contact, by the load.

    For `rom.Mechanism.gear_mesh`, as ``stiffness`` per length of contact line and ``hertz``.

    Args:
        pair: spur or helical gears.
        n: places from first to last contact.
        E: Young's modulus [Pa].
        nu: Poisson's ratio of the contact; bending has 0.3.
        body: see `tooth_compliance`.

    Raises:
        ModelError: as `pair_stiffness`.
    """
    teeth = (_both_teeth(pair, s, body) for s in places_of_contact(pair, n))
    own, depths, _ = zip(*teeth, strict=True)
    return E / np.array(own), Hertz(np.array(depths), E, nu)


def iso_stiffness(pair: GearPair) -> tuple[float, float, float]:
    """Stiffness after ISO 6336-1: c'_th, c' of a pair, and mean value of the mesh [N/m^2].

    Solid wheels; the basic rack counts by its dedendum and its normal pressure angle.
    """
    (z1, z2), (x1, x2) = _virtual_teeth(pair), pair.shift
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2
    q += -0.24188 * x2 / z2 + 0.00529 * x1**2 + 0.00182 * x2**2
    ideal = 1e9 / q  # from mm um / N
    rack = 1 + 0.5 * (1.2 - pair.dedendum)
    rack *= 1 - 0.02 * (20 - np.degrees(pair.pressure_angle))
    single = 0.8 * rack * ideal * np.cos(pair.helix)
    return float(ideal), float(single), float(single * (0.75 * pair.contact_ratio + 0.25))


def _half_angle(pair: GearPair, gear: int, radius: Array) -> Array:
    """Half of the angle of a tooth at radii [rad]; radial flanks below the base circle."""
    at_base = pair.base_thickness[gear] / (2 * pair.rb[gear])
    return at_base - involute(np.arccos(np.clip(pair.rb[gear] / radius, None, 1.0)))


def _sainsot(pair: GearPair, gear: int, root: float, u: float, tan2: float, bore: float) -> float:
    theta = float(np.arcsin(root / (2 * pair.rf[gear])))
    h = pair.rf[gear] / (bore * pair.r[gear])
    terms = np.array([1 / theta**2, h**2, h / theta, 1 / theta, h, 1.0])
    L, M, P, Q = np.array(list(RIM_COEFFICIENTS.values())) @ terms
    x = u / (2 * pair.rf[gear] * theta)
    return float(L * x**2 + M * x + P * (1 + Q * tan2))
