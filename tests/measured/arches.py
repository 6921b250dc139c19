"""Arches that were loaded until they fell: five bare rings, and a bridge under its fill."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from measured.record import Numbers, Structure
from scipy.optimize import linprog

from rom.components.masonry import Joint, Masonry, PointLoad, Rock, arch, load_factor, simulate
from rom.errors import ConfigError
from rom.model import Array

GRAVITY = 9.81


@dataclass(frozen=True)
class Arch:
    """What a source says of a ring.

    Attributes:
        span, rise: of the line that ``line`` names [m].
        line: -1 for the intrados, 0 for the centre line, in half thicknesses.
        doubt: how far this line may be another one, in half thicknesses.
        thickness, width: [m].
        courses: number of voussoirs.
        at: where the load stands, as a part of the span.
        density: [kg/m^3].
        strength: under pressure [Pa].
    """

    span: float
    rise: float
    line: float
    doubt: float
    thickness: float
    width: float
    courses: int
    at: float
    density: float
    strength: float


CAROZZI = Arch(3.3, 0.83, 0, 1, 0.12, 0.25, 57, 0.556 / 3.3, 1800.0, 3.5e6)
OLIVEIRA = Arch(1.467, 0.593, -1, 0, 0.05, 0.45, 59, 0.25, 1800.0, 9.1e6)
BARE = {
    "Carozzi U_A": CAROZZI,
    "Carozzi U_A at the quarter": replace(CAROZZI, at=0.25),
    "Carozzi U_V": replace(CAROZZI, thickness=0.06, width=0.3, at=0.25),
    "Oliveira US-1": OLIVEIRA,
    "Oliveira US-2": OLIVEIRA,
    "Borri": Arch(2.0, 1.0, -1, 1, 0.125, 0.25, 48, 0.5, 1807.0, 6.63e6),
}
PRESTWOOD = Arch(6.55, 1.428, -1, 0, 0.22, 3.8, 98, 0.25, 1800.0, 4.5e6)
# [kN] under which bare arches with joints of the assumed bond give way that break one by one
BRITTLE = {
    "Carozzi U_A": 0.951,
    "Carozzi U_A at the quarter": 0.901,
    "Carozzi U_V": 0.186,
    "Oliveira US-1": 0.297,
    "Borri": 0.689,
}
PATCH, FILL = 0.3, 2040.0  # length of the load [m], density of the fill [kg/m^3]


@dataclass(frozen=True)
class Ring:
    """One arch of n voussoirs.

    Attributes:
        n: number of voussoirs.
        radius, thickness: of the centre line, and of the ring [m].
        half: angle from the crown to the springing [rad].
        density: [kg/m^3].
    """

    n: int
    radius: float
    thickness: float
    half: float
    density: float

    @property
    def angles(self) -> Array:
        """(n + 1,) angles of the joints from the crown to the right [rad]."""
        return np.linspace(-self.half, self.half, self.n + 1)

    def line(self, offset: float = 0.0) -> Array:
        """(n + 1, 2) points of the joints, on the centre line or beside it."""
        r = self.radius + offset
        return r * np.column_stack([np.sin(self.angles), np.cos(self.angles)])

    def back(self) -> Array:
        """(n + 1, 2) points of the joints on the extrados."""
        return self.line(self.thickness / 2)


def ring(one: Arch, n: int, thickness: float, rise: float, datum: float, density: float) -> Ring:
    """The ring; thickness, rise and density as factors, datum as a part of the doubt."""
    t, half, f = thickness * one.thickness, one.span / 2, rise * one.rise
    R = (half**2 + f**2) / (2 * f)
    centre = R - (one.line + datum * one.doubt) * one.thickness / 2
    return Ring(n, centre, t, float(np.arccos(1 - f / R)), density * one.density)


Load = tuple[int, Array, Array]  # voussoir from the left, point on its back [m], force [N/m]


def on_back(one: Ring, x: float, y: float = -1.0) -> Load:
    """A vertical load on the voussoir that lies below it."""
    back = one.back()
    k = int(np.clip(np.searchsorted(back[:, 0], x) - 1, 0, one.n - 1))
    a, b = back[k : k + 2]
    return k, a + (x - a[0]) / (b[0] - a[0]) * (b - a), np.array([0.0, y])


def at_part(one: Ring, part: float) -> Load:
    """A vertical load of one at a part of the span of the centre line."""
    return on_back(one, (2 * part - 1) * one.radius * np.sin(one.half))


def spread(one: Ring, x: float, length: float) -> list[Load]:
    """A load of one, spread evenly over a length about x [m]."""
    ends = np.clip(one.back()[:, 0], x - length / 2, x + length / 2)
    return [on_back(one, (a + b) / 2, -(b - a) / length) for a, b in pairwise(ends) if b > a]


def depths(one: Ring, crown: float) -> Array:
    """(n + 1,) depth of the joints below a level surface [m]."""
    back = one.back()[:, 1]
    return np.asarray(crown + one.radius + one.thickness / 2 - back)


def weight_of_fill(one: Ring, crown: float, density: float) -> list[Load]:
    """Columns of fill, each at its centroid."""
    z, x = depths(one, crown), one.back()[:, 0]
    loads = []
    for k in range(one.n):
        width, (a, b) = x[k + 1] - x[k], z[k : k + 2]
        middle = x[k] + width * (a + 2 * b) / (3 * (a + b))
        loads.append(on_back(one, middle, -GRAVITY * density * width * (a + b) / 2))
    return loads


def upright(one: Ring, crown: float, density: float) -> tuple[Array, Array, Array]:
    """Of each voussoir: vertical pressure [Pa], height of its back [m], way to push it inwards."""
    z = depths(one, crown)
    way = np.where(np.arange(one.n) < one.n / 2, 1.0, -1.0)
    return GRAVITY * density * (z[1:] + z[:-1]) / 2, np.abs(np.diff(z)), way


def push_of_fill(one: Ring, crown: float, density: float, ratio: float) -> list[Load]:
    """Horizontal pressure on the half away from the load, as a ratio of the vertical one."""
    pressure, height, way = upright(one, crown, density)
    middle = (one.back()[1:] + one.back()[:-1]) / 2
    force = ratio * pressure * height * way
    return [(k, middle[k], np.array([force[k], 0.0])) for k in np.flatnonzero(way < 0)]


def earth_that_yields(
    one: Ring, crown: float, density: float, angle: float, cohesion: float
) -> tuple[Array, Array, Array]:
    """Least and largest inward thrust on each voussoir [N/m] after Rankine, and its way."""
    pressure, height, way = upright(one, crown, density)
    most = passive(angle)
    return (
        pressure * height / most,
        (most * pressure + 2 * cohesion * np.sqrt(most)) * height,
        way,
    )


def passive(angle: float) -> float:
    """Horizontal over vertical pressure of fill that is pushed, friction in degrees."""
    return float(np.tan(np.pi / 4 + np.radians(angle) / 2) ** 2)


def stones(one: Ring, friction: float, bond: float, E: float = 2e9) -> Masonry:
    """The component's arch; bond is shear and flexural strength, of joints of a metre of depth.

    A joint that pulls everywhere alike has three times the moment of one that bends elastically.
    """
    rock = Rock(E=E, rho=one.density, friction=friction)
    bare = arch(one.n, one.radius, one.thickness, half_angle=one.half, rock=rock)
    return replace(bare, joints=(Joint(friction, bond, bond / 3),)) if bond else bare


def points(loads: list[Load]) -> list[PointLoad]:
    """Loads as the component has them; the first of its stones is a springer."""
    return [PointLoad(k + 1, tuple(map(float, x)), tuple(map(float, f))) for k, x, f in loads]


def borne(model: Masonry, loads: list[Load], dead: list[Load]) -> float:
    """Load by the component [N/m]; none where the arch does not stand alone."""
    try:
        return load_factor(model, points(loads), dead=points(dead))
    except ConfigError:
        return 0.0


def gives_way(what: Arch, bond: float, friction: float = 0.6, time: float = 4.0) -> float:
    """Load under which stones on brittle joints have moved by 0.5 mm [N/m], growing slowly."""
    one = ring(what, what.courses, 1.0, 1.0, 0.0, 1.0)
    model, (load,) = stones(one, friction, bond), points([at_part(one, what.at)])
    most = load_factor(model, [load]) * (1.0 if bond else 1.2)
    still = simulate(model, t_end=0.2, dt=1e-3, damping=np.inf, save_every=200)
    act = replace(load, force=(0.0, -most), history=lambda t: t / time)
    run = simulate(model, t_end=time, dt=1e-3, actions=[act], damping=30.0, save_every=10,
                   q=still.q[-1])  # fmt: skip
    moved = np.abs(run.q[..., :2] - run.q[0, :, :2]).max(axis=(1, 2)) > 5e-4
    return float(most * run.t[moved.argmax()] / time) if moved.any() else np.inf


def plastic(
    one: Ring,
    loads: list[Load],
    dead: list[Load],
    *,
    friction: float,
    strength: float = np.inf,
    bond: float = 0.0,
    earth: tuple[Array, Array, Array] | None = None,
) -> float:
    """Load by forces and moments in the joints alone [N/m], without stones and corners.

    Unknown are three reactions at the left springing, the factor of the loads and, with ``earth``,
    the inward thrust (least, largest, direction) on each voussoir. A joint under the thrust N bears
    the moment of blocks of stress, strength against bond / 3, whose curve is cut by tangents.
    """
    n, t, c = one.n, one.thickness, one.line()
    way = np.column_stack([np.cos(one.angles), -np.sin(one.angles)])  # along the ring
    back = (one.back()[1:] + one.back()[:-1]) / 2
    inward = earth[2] if earth else np.zeros(0)
    columns = np.zeros((n + 1, 3, 4 + inward.size))  # forces x, y and moment at the joints' centres
    columns[:, :, :3] = np.eye(3)
    columns[:, 2, 0], columns[:, 2, 1] = c[:, 1] - c[0, 1], c[0, 0] - c[:, 0]
    known = np.zeros((n + 1, 3))

    def act(into: Array, k: int, x: Array, force: Array) -> None:
        arm = x - c[k + 1 :]
        into[k + 1 :, :2] += force
        into[k + 1 :, 2] += arm[:, 0] * force[1] - arm[:, 1] * force[0]

    half = np.diff(one.angles) / 2
    middle = (one.angles[1:] + one.angles[:-1]) / 2
    centroid = one.radius * (1 + t**2 / 12 / one.radius**2) * np.sin(half) / half
    own = GRAVITY * one.density * one.radius * t * 2 * half
    for k in range(n):
        x = centroid[k] * np.array([np.sin(middle[k]), np.cos(middle[k])])
        act(known, k, x, np.array([0.0, -own[k]]))
    for k, x, force in dead:
        act(known, k, x, force)
    for k, x, force in loads:
        act(columns[:, :, 3], k, x, force)
    for k, sign in enumerate(inward):
        act(columns[:, :, 4 + k], k, back[k], np.array([sign, 0.0]))

    def rows(a: Array) -> Iterator[Array]:
        """Thrust, shear and moment of the joints, each (n + 1, ...)."""
        yield np.einsum("ji,ji...->j...", way, a[:, :2])
        yield np.einsum("ji,ji...->j...", way @ np.array([[0, 1.0], [-1, 0]]), a[:, :2])
        yield a[:, 2]

    (N, T, M), (N0, T0, M0) = rows(columns), rows(known)
    bonded, pull = bond * t, bond / 3 * t
    tops: list[tuple[float, float]] = [(t / 2, pull * t / 2)]  # slope and moment without thrust
    if np.isfinite(strength):
        total = strength + bond / 3
        depth = np.linspace(0, 1, 60) ** 2 * t  # of the block under pressure
        slope, moment = (t / 2 - depth), total * depth * (t - depth) / 2
        tops = [
            (s, m - s * (total * d - pull)) for s, m, d in zip(slope, moment, depth, strict=True)
        ]
    A = [sign * M - s * N for sign in (-1, 1) for s, _ in tops]
    b = [m - sign * M0 + s * N0 for sign in (-1, 1) for s, m in tops]
    A += [sign * T - friction * N for sign in (-1, 1)] + [-N]
    b += [bonded - sign * T0 + friction * N0 for sign in (-1, 1)] + [pull + N0]
    bounds = [(None, None)] * 3 + [(0, None)]
    if earth:
        bounds += list(zip(*earth[:2], strict=True))
    found = linprog(-np.eye(4 + inward.size)[3], np.vstack(A), np.concatenate(b), bounds=bounds)
    return float(found.x[3]) if found.status == 0 else 0.0


def masonry_arches(mesh: int, **p: float) -> Numbers:
    """Loads at which arches fall; ``mesh`` joints a course."""
    shape = {key: p[key] for key in ("thickness", "rise", "datum", "density")}
    found = {}
    for name, what in BARE.items():
        if name == "Oliveira US-2":  # built as US-1
            again = {key.replace("US-1", "US-2"): x for key, x in found.items() if "US-1" in key}
            found |= again
            continue
        one = ring(what, mesh * what.courses, **shape)
        load = [at_part(one, what.at + p["at"])]
        strength = p["strength"] * what.strength
        loads = {
            "no tension": borne(stones(one, p["friction"], 0.0), load, []),
            "crushing": plastic(one, load, [], friction=p["friction"], strength=strength),
            "glued": borne(stones(one, p["friction"], p["bond"]), load, []),
        }
        for kind, force in loads.items():
            found[f"{name}, {kind} [kN]"] = 1e-3 * what.width * force
    return found | bridge(mesh, shape, p)


def bridge(mesh: int, shape: Numbers, p: Numbers) -> Numbers:
    """Prestwood bridge: the ring alone, then its fill weighs, pushes back, and yields."""
    what, friction = PRESTWOOD, p["friction"]
    one = ring(what, mesh * what.courses, **shape)
    x, crown, density = (what.at + p["at"] - 0.5) * what.span, p["depth"], p["soil"] * FILL
    deep = float(np.interp(x, one.back()[:, 0], depths(one, crown)))
    near, load = spread(one, x, PATCH), spread(one, x, PATCH + 2 * p["spread"] * deep)
    weight = weight_of_fill(one, crown, density)
    push = weight + push_of_fill(one, crown, density, p["passive"] * passive(p["angle"]))
    earth = earth_that_yields(one, crown, density, p["angle"], p["cohesion"])
    strength = p["strength"] * what.strength
    model = stones(one, friction, 0.0)
    loads = {
        "ring alone": borne(model, near, []),
        "fill weighs": borne(model, load, weight),
        "fill pushes": borne(model, load, push),
        "fill pushes, crushing": plastic(one, load, push, friction=friction, strength=strength),
        "fill yields, crushing": plastic(
            one, load, weight, friction=friction, strength=strength, earth=earth
        ),
    }
    return {f"Prestwood, {kind} [kN]": 1e-3 * what.width * force for kind, force in loads.items()}


ARCHES = Structure(
    "masonry_arches",
    masonry_arches,
    {"thickness": (1.0, 0.03), "rise": (1.0, 0.01), "datum": (0.0, 1.0), "density": (1.0, 0.08),
     "at": (0.0, 0.015), "friction": (0.6, 0.15), "strength": (1.0, 0.3), "bond": (1e5, 1e5),
     "depth": (0.165, 0.03), "soil": (1.0, 0.1), "spread": (0.5, 0.25), "passive": (1 / 3, 1 / 3),
     "angle": (30.0, 5.0), "cohesion": (5e3, 5e3)},
    (1, 2),
    "Density 1800 kg/m3 where none is told, and 57, 48, 98 courses where they are not "
    "counted. Bond:\n"
    "shear strength, and flexural strength that a code gives any mortar with clay bricks. Glued\n"
    "joints give way all at once, brittle ones bear less: joints of the moving arches, BRITTLE.\n"
    "The ring that no tension holds and that does not stand alone bears 0. Carozzi's load "
    "stands\n"
    "0.556 m from the abutment, about a quarter of the span: both are here. Fill pushes with a\n"
    "third of Rankine's passive pressure on the half away from the load; where it yields it\n"
    "pushes with anything between active and passive pressure and cohesion. Known before: the\n"
    "bridge fell under 228 kN, arch U_A had its first hinge near 1.9 kN and the order of its\n"
    "hinges; others compute 40.6 kN for the ring alone and take 0.03 MPa of tension for "
    "Borri's.",
)  # fmt: skip
