"""Rods that were measured: a rotating strip with a swept tip, laminates under weights, a wing."""

from itertools import product

import numpy as np
from measured.record import Numbers, Structure

from rom import rotation
from rom.components.cosserat import Rod, Shape, equilibrium, loads, modes, rod
from rom.model import Array

GRAVITY = 9.80665
SWEEPS, SPEEDS = (0, 15, 30, 45), (0, 500, 750)  # [degrees], [1/min]
ROOT, STRAIGHT, TIP = 0.0635, 0.8001, 0.1524  # of the strip, radius and lengths [m]
WIDTH, POISSON = 0.0254, 0.325


def turned(angle: float, axis: int) -> Array:
    """(3, 3) rotation by degrees about an axis of the world."""
    return rotation.matrix(rotation.exp(np.radians(angle) * np.eye(3)[axis]))


def swept(n: int, sweep: float, E: float, rho: float, t: float, clamp: float) -> Rod:
    """The strip in the plane of rotation: section axes across, along the axis of rotation, out."""
    b, G = WIDTH, E / 2 / (1 + POISSON)
    flap, lag = b * t**3 / 12, t * b**3 / 12
    J = b * t**3 / 3 * (1 - 0.63 * t / b)
    many = round(n * STRAIGHT / TIP)
    ways = [np.eye(3)[0]] * many + [turned(-sweep, 2)[:, 0]] * n
    h = np.r_[np.full(many, (STRAIGHT + clamp) / many), np.full(n, TIP / n)]
    x = np.vstack([[ROOT - clamp, 0, 0], h[:, None] * ways]).cumsum(axis=0)
    frames = [np.column_stack([np.cross([0, 0, 1], d), [0, 0, 1], d]) for d in ways]
    p = [rotation.quaternion(frame) for frame in (frames[0], *frames, frames[-1])]
    shear = G * b * t / 1.2
    return rod(x, p, stretch=(shear, shear, E * b * t), bend=(E * flap, E * lag, G * J),
               mass=rho * b * t, inertia=(rho * flap, rho * lag, rho * (flap + lag)))  # fmt: skip


def epps_chandra(n: int, *, E: float, density: float, thickness: float, clamp: float) -> Numbers:
    """Frequencies out of the plane of rotation, the lowest three and the next three, ascending."""
    found = {}
    for sweep, rpm in product(SWEEPS, SPEEDS):
        spin = (0.0, 0.0, rpm * np.pi / 30)
        one = swept(n, sweep, E, density, thickness, clamp)
        shape = equilibrium(one, loads(one), spin=spin)
        some = modes(one, shape, 10, spin=spin)
        d = np.vstack([some.shapes, np.zeros((3, 10))]).reshape(-1, 2, 3, 10)
        turn, way = (np.abs(d[:, k]) ** 2 * scale for k, scale in ((0, 0.01), (1, 1.0)))
        out = (way[:, 2] + turn[:, 0] + turn[:, 2]).sum(axis=0)
        out = some.frequencies[out > (way[:, :2].sum(axis=1) + turn[:, 1]).sum(axis=0)]
        for k in range(6 if rpm == SPEEDS[-1] else 3):
            name = f"flap {k + 1}" if k < 3 else f"coupled {k - 2}"
            found[f"sweep {sweep}, {name}, {rpm} rpm [Hz]"] = float(out[k])
    return found


LAMINATES = {  # EA, GAy, GAz, GJ, EIy, EIz, C45, C14 [N, N m^2, N m]
    1: (3.7e6, 2.6e5, 2.9e5, 0.183, 0.707, 276.0, 0.0, 0.0),
    2: (4.0e6, 2.6e5, 5.5e5, 0.368, 0.522, 298.0, -0.102, 0.0),
    3: (3.9e6, 1.1e6, 1.2e5, 1.18, 0.983, 290.0, 0.0, -522.0),
}
WEIGHTS = (20, 50, 75, 100, 150, 200, 300, 400)  # [g]
AXES = np.eye(3)[:, [1, 2, 0]]  # section axes: y, z, x along the rod


def laminate(n: int, beam: int, angle: float, length: float, own: float, E: float, t: float) -> Rod:
    """A strip whose section axes are the principal ones of bending and twist.

    These lean against the rod where twist and bending are coupled. Stretch is stiff and alike along
    all three axes, so that it does not notice; coupled with twist it takes C14^2 / EA from GJ, as
    next to no force pulls along the strip.
    """
    EA, GAy, _, GJ, EIy, EIz, C45, C14 = LAMINATES[beam]
    weak = E * t**3 * np.array([EIy, GJ - C14**2 / EA, C45])
    B = np.array([[weak[0], 0, weak[2]], [0, E * t * EIz, 0], [weak[2], 0, weak[1]]])
    bend, own_axes = np.linalg.eigh(B)
    own_axes *= np.sign(np.linalg.det(own_axes))
    frame = turned(angle, 0) @ AXES @ own_axes
    x = np.outer(np.linspace(0, length, n + 1), [1.0, 0, 0])
    p = np.tile(rotation.quaternion(frame), (n + 2, 1))
    return rod(x, p, stretch=GAy, bend=bend, mass=own)


def hung(one: Rod, mass: float) -> Shape:
    """Under its own weight and a mass at its end."""
    load = loads(one, tip=(0, 0, -GRAVITY * mass), weight=(0, 0, -GRAVITY))
    return equilibrium(one, load)


def minguet_dugundji(
    n: int,
    *,
    modulus: float,
    thickness: float,
    own: float,
    datum: float,
    clamp: float,
    angle: float,
) -> Numbers:
    """Displacements 0.5 m from the root of strips 0.55 m long."""
    found = {}
    for beam, root in product(LAMINATES, (0, 45)):
        one = laminate(n, beam, root + angle, 0.55 + clamp, own, modulus, thickness)
        at = round(n * 10 / 11)
        before = datum * (hung(one, 0.0).x - one.x)[at] if own else 0.0
        for weight in WEIGHTS:
            u = (hung(one, 1e-3 * weight).x - one.x)[at] - before
            for name, value in zip(("-u1", "u2", "-u3"), u * (-1, 1, -1), strict=True):
                found[f"beam {beam}, {root} deg, {name}, {weight} g [m]"] = float(value)
    return found


SEMISPAN = 0.5498  # [m]
WINGS = {"no skin": (4.42, 6.45, 7.28), "skin": (4.475, 6.51, 7.58)}  # EI, GJ from, to [N m^2]
MASSES = np.arange(1, 16) / 5  # [kg]


def wing(
    n: int, skin: str, arm: float, bending: float, twist: float, own: float, clamp: float
) -> Rod:
    """The spar, then a rigid link of the length of the arm across it, to where a mass hangs."""
    EI, low, high = WINGS[skin]
    x = np.vstack([np.outer(np.linspace(-clamp, SEMISPAN, n + 1), [1.0, 0, 0]), [SEMISPAN, arm, 0]])
    p = np.tile(rotation.quaternion(AXES), (n + 3, 1))
    stretch, mass = np.full((n + 1, 3), 1e7), np.append(np.full(n, own), 0.0)
    bends = np.arange(n + 1) < n
    bend = (bending * EI, 3287.0, low + twist * (high - low))
    return rod(x, p, stretch=stretch, bend=bend, mass=mass, bends=bends)


def pazy(
    n: int, *, bending: float, twist: float, own: float, datum: float, clamp: float, arm: float
) -> Numbers:
    """Displacement and twist of the tip under masses at the spar or beside the wing."""
    found = {}
    for skin, kind in product(WINGS, ("bending", "torsion")):
        one = wing(n, skin, arm if kind == "torsion" else 1e-3, bending, twist, own, clamp)
        before = datum * (hung(one, 0.0).x - one.x)[n, 2]
        for mass in MASSES[: 15 if skin == "skin" else 10]:
            shape = hung(one, mass)
            down = before - (shape.x - one.x)[n, 2]
            name = f"{skin} {kind}, {mass:.1f} kg"
            found[f"{name}, displacement [% of the semispan]"] = float(100 * down / SEMISPAN)
            if kind == "torsion":
                chord = shape.frame(-2)[:, 0]
                found[f"{name}, twist [deg]"] = float(-np.degrees(np.arcsin(chord[2])))
    return found


EPPS_CHANDRA = Structure(
    "epps_chandra",
    epps_chandra,
    {"E": (73.1e9, 0.02 * 73.1e9), "density": (2682.0, 0.01 * 2682.0),
     "thickness": (1.6e-3, 0.06e-3), "clamp": (0.0, 1.6e-3)},
    (4, 8),
    "Thickness by the rolling tolerance, clamp by one thickness. Coupled are modes 4 to 6 out of\n"
    "the plane of rotation, paired with what was measured in ascending order at each sweep.",
)  # fmt: skip
MINGUET_DUGUNDJI = Structure(
    "minguet_dugundji",
    minguet_dugundji,
    {"modulus": (1.0, 0.02), "thickness": (1.0, 0.02), "own": (0.07, 0.07), "datum": (1.0, 1.0),
     "clamp": (0.0, 2e-3), "angle": (0.0, 1.0)},
    (44, 88),
    "Own mass per length by width and thickness from EIz / EA and EIy / EA, of carbon and epoxy.\n"
    "Displacements are from the shape under own weight (datum 1), which is not said (spread 1).\n"
    "World axes, x along the strip at rest, z up; turned by a positive angle about x.",
    span=0.55,
)  # fmt: skip
PAZY = Structure(
    "pazy",
    pazy,
    {"bending": (1.0, 0.05), "twist": (0.5, 0.5), "own": (0.02068 / 0.03825, 0.05),
     "datum": (0.0, 1.0), "clamp": (0.0, 1e-3), "arm": (0.1295, 0.006)},
    (40, 80),
    "Displacements are from the straight wing, own weight acting (datum 0), as programs that were\n"
    "compared with the tests have it; it is not said (spread 1). Bending stiffness by 2 % of E\n"
    "and 1.5 % of thickness. In torsion one source has the mass 80 mm before the leading edge,\n"
    "one 80 mm behind the trailing edge of a chord of 98.9 mm with the spar at 44.1 % of it: an\n"
    "arm of 123.6 or 135.3 mm.",
    span=100.0,
)  # fmt: skip
RODS = (EPPS_CHANDRA, MINGUET_DUGUNDJI, PAZY)
