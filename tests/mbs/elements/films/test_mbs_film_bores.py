"""Oil films that bend their bores: limits, tangents, energy, an elastic film of another program."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu, spsolve

import rom
from cases.mbs.films import ORIGIN, held_rotor
from cases.mbs.mechanisms import prepared, residual_at, tangents_at
from cases.mbs.tangents import forces_at, shifted
from cases.mbs.tubes import tube
from cases.refusals import refuses
from rom.components.journal_bearing.films.journals import FIRST_CONTENT, KNOWN, TIME
from rom.mbs import Groove, JournalBearing

DIAMETER, LENGTH, CLEARANCE, OUTER = 0.04, 0.04, 4e-5, 0.03
SOFT, STEEL = 5e9, 2e11  # moduli [Pa]
SPEED, OIL, LOAD = 300.0, 0.02, (0.0, -2000.0)
CELLS = (24, 2, 6)  # of the bush; its bore ends a cell before the ends
SOFT_FILM = {"axis": (0, 0, 1), "oil": OIL, "elastic_bush": True}
NONE = np.zeros(0)
# by ROSS: load [N], modulus [Pa], eccentricity [1], attitude [degrees], largest pressure [MPa]
ROSS = [
    (10638.3, None, 0.45904, 49.200, 2.4443),
    (10638.3, 1e9, 0.50002, 39.915, 2.3617),
    (23148.1, 2e9, 0.69580, 31.346, 5.7459),
]


def bearing(cells=(60, 8), grooves=(), **more):
    return JournalBearing(DIAMETER, LENGTH, CLEARANCE, grooves, cells=cells, **more)


@cache
def ring(E=SOFT, cells=CELLS):
    material = rom.Material(E=E, nu=0.3, rho=2000.0)
    return tube(DIAMETER / 2, OUTER, LENGTH * cells[2] / (cells[2] - 2), cells, material)


@cache
def bush(functions, E=SOFT, cells=CELLS, reference="rim"):
    """The same reduced; its rim is rigid."""
    return rom.reduce(ring(E, cells), method=rom.Guyan(), certify=False, reference=reference,
                      interfaces={"bore": functions, "rim": "rbe2"})  # fmt: skip


def at_rest(body, b=None, load=LOAD, speed=SPEED, **more):
    """Where a loaded rotor rests (2,) [m], and what its film is like."""
    mech = held_rotor(b or bearing(), load, speed=speed, oil=OIL, body=body, **more)
    state = rom.equilibrium(mech, spin={"turn": speed})
    film = rom.mbs.snapshot(mech, state).journal_bearing("film")
    at = prepared(mech)[0].system.bodies.q_at[list(mech.parts).index("shaft")]
    return state.q[at : at + 2], film


@pytest.mark.filterwarnings("ignore:the speed of sound")
def test_a_bush_that_is_stiff_enough_is_a_rigid_one():
    """By a million; and a soft one is where nobody asks for its bore."""
    body = bush(rom.FourierLegendre(4, 2), 1e6 * STEEL)
    (at, film), (wanted, rigid) = at_rest(body), at_rest(None)
    assert_allclose(at, wanted, rtol=1e-6)
    for name in ("pressure", "thinnest", "power", "side_flow"):
        assert_allclose(getattr(film, name), getattr(rigid, name), rtol=1e-6)
    soft, film = at_rest(bush(rom.FourierLegendre(4, 2)), elastic_bush=False)
    assert film.pressure == pytest.approx(rigid.pressure, rel=1e-6)
    assert np.linalg.norm(soft - wanted) > 5e-7
    assert film.opening is None


def test_a_film_opens_by_what_nodes_under_its_cells_move_outwards():
    """Angles count from Y, heights upwards; what the bore does on the whole is no opening."""
    body = bush(rom.FourierLegendre(2, 1))
    b = JournalBearing(DIAMETER, 0.03, CLEARANCE, cells=(24, 3))
    mech = rom.Mechanism(gravity=ORIGIN)
    part = mech.add_flexible("bush", body, at=ORIGIN)
    mech.journal_bearing("film", mech.ground.marker(ORIGIN), part.marker("bore"),
                         reference=(0, 1, 0), bearing=b, **SOFT_FILM)  # fmt: skip
    bore, functions = body.markers["bore"], mech.journal_bearings["film"].bore
    q = np.random.default_rng(1).normal(size=part.r)
    x, moved = bore.patch.points, (bore.patch.shapes @ bore.hold[:, 6:] @ q).reshape(-1, 3)
    moved -= bore.translation @ q + np.cross(bore.rotation @ q, x - bore.point)
    theta = np.pi / 2 + 2 * np.pi / 24 * np.arange(24)
    at = np.stack([DIAMETER / 2 * np.cos(theta), DIAMETER / 2 * np.sin(theta)], axis=1)
    places = np.array([[*xy, z] for xy in at for z in (-0.01, 0.0, 0.01)])
    apart = np.linalg.norm(places[:, None] - x, axis=2)
    assert apart.min(axis=1).max() < 0.01 * DIAMETER
    near = apart.argmin(axis=1)
    outwards = np.einsum("na,na->n", moved[near, :2], np.repeat(at, 3, axis=0)) / (DIAMETER / 2)
    opened = functions[0] @ functions[1] @ q
    assert_allclose(opened, outwards, atol=1e-6 * np.abs(outwards).max())
    assert np.ptp(outwards.reshape(24, 3), axis=1).max() > 0.1 * np.abs(outwards).max()


def pair(law, reference="mean-axis"):
    """A journal in a soft bush, both anywhere, beside another in the ground.

    The last two are units of motions, and where the soft film remembers.
    """
    mech = rom.Mechanism(gravity=ORIGIN)
    own = {"mass": 0.2, "inertia": (1e-4, 2e-4, 3e-4)}
    mech.add_rigid("other", **own, at=ORIGIN)
    full = {"axis": (0, 0, 1), "bearing": bearing((40, 4)), "oil": OIL}
    mech.journal_bearing("first", "other", "ground", **full)
    turned = np.array([0.8, 0.3, -0.4, 0.33])
    at = {"at": (0.3, -0.2, 0.1), "orientation": turned / np.linalg.norm(turned)}
    part = mech.add_flexible("bush", bush(rom.FourierLegendre(3, 2), SOFT, (16, 1, 6), reference),
                             **at)  # fmt: skip
    journal = mech.add_rigid("journal", **own, **at)
    axis, across = rom.rotation.matrix(at["orientation"]).T[[2, 0]]
    b = bearing((30, 6), [Groove(1.2, 0.3, 1e5, share=0.7)], cavitation=law)
    mech.journal_bearing("film", journal.marker(ORIGIN), part.marker("bore"), reference=across,
                         bearing=b, **SOFT_FILM | {"axis": axis})  # fmt: skip
    packed, W = prepared(mech)
    rng, film, size = np.random.default_rng(3), mech.journal_bearings["film"], packed.v.size
    opened, bent = film.bore[0] @ film.bore[1], slice(12, -6)
    scale = np.ones(size)
    scale[bent] = 1.0 / np.maximum(np.abs(opened).max(axis=0), 0.1 * np.abs(opened).max())
    delta, v = 5e-6 * rng.normal(size=size), 1e-3 * rng.normal(size=size)
    wide, fast = 8e-6 * rng.normal(size=len(opened)), 2e-3 * rng.normal(size=len(opened))
    delta[bent], v[bent] = (np.linalg.lstsq(opened, x, rcond=1e-3)[0] for x in (wide, fast))
    v[[5, -1]] = SPEED
    memory = len(packed.places.coordinates) + packed.places.memory("film", NONE)
    return packed, W, shifted(packed, packed.q, delta), v, scale, memory


@pytest.mark.parametrize(("law", "passed"), [("none", 0.0), ("reynolds", 0.0), ("jfo", 0.0),
                                             ("jfo", 1e-3)])  # fmt: skip
def test_tangents_are_the_derivatives(law, passed):
    packed, W, q, v, scale, memory = pair(law)

    def force(dq, dv):
        return forces_at(packed, W, shifted(packed, q, dq), v + dv)

    assert np.isfinite(force(0 * v, 0 * v)).all()
    W.base[len(packed.places.coordinates) :] = W.fresh
    W.base[memory + KNOWN], W.base[memory + TIME] = float(passed > 0.0), -passed
    W.base[memory + FIRST_CONTENT :] *= 0.97
    step, none, faster = 1e-10 * scale, 0 * v, 3e5 if passed else 1e3  # no void closes
    for moves in (True, False):
        steps = np.diag(step if moves else faster * step)
        both = [(force(e, none), force(-e, none)) if moves else (force(none, e), force(none, -e))
                for e in steps]  # fmt: skip
        found = np.array([(one - two) / 2 for one, two in both]).T
        tangents_at(packed.system, W, q, v, none, NONE, (0.0, float(not moves), float(moves)))
        known = (W.Kt if moves else W.S) @ steps
        floor = 1e-3 * np.abs(found[[0, 1, 6, 7, -6, -5]]).max()
        for columns in (slice(0, 6), slice(6, 12), slice(12, -6), slice(-6, None)):
            size = np.maximum(np.abs(found[:, columns]).max(axis=1, keepdims=True), floor)
            assert_allclose(known[:, columns] / size, found[:, columns] / size, atol=1e-5)


def test_what_bodies_and_bore_lose_is_what_the_film_reports():
    """Power of all forces at the velocities, less that of a film nearly without viscosity."""
    packed, W, q, v, *_ = pair("reynolds")
    (table,) = packed.elements.values()
    lost = []
    for _ in range(2):
        residual_at(packed.system, W, q, v, 0 * v, NONE)
        lost.append((W.residual @ v, W.power[2]))
        table.oil[:, 0] *= 1e-9
    by_forces, by_film = np.subtract(*lost)
    assert by_forces == pytest.approx(by_film, rel=1e-10)
    assert by_film > 100.0


def test_a_free_pair_keeps_momentum_and_energy():
    """What the film takes is heat; what it gives to the bore is in the bore."""
    mech = rom.Mechanism(gravity=ORIGIN)
    body = bush(rom.FourierLegendre(2, 1), SOFT, (16, 1, 6), "mean-axis")
    mech.add_flexible("bush", body, at=ORIGIN, omega=(0, 0, -20.0), velocity=(0.4, 0, 0))
    mech.add_rigid("journal", mass=0.3, inertia=(1e-4, 1e-4, 2e-4), at=(1e-5, 2e-5, 0),
                   omega=(0, 0, 300.0), velocity=(0.4, 0.01, 0))  # fmt: skip
    mech.journal_bearing("film", "journal", "bush.bore", bearing=bearing((30, 4)), **SOFT_FILM)
    sol = rom.simulate(mech, t_end=2e-3, dt=2e-6, method="bdf", save_every=20, progress=False)
    p, L = sol.momentum
    assert_allclose(p, np.tile(p[0], (len(p), 1)), atol=1e-9 * np.abs(p[0]).max())
    assert_allclose(L, np.tile(L[0], (len(L), 1)), atol=1e-6 * np.abs(L[0]).max())
    assert sol.energy.damping[-1] > 0.1
    assert rom.audit(sol).ok


@cache
def compliance(E, cells):
    """Radial motion of the nodes of the bore by radial forces on them; their angles and heights."""
    model, (n, n_r, n_z) = ring(E, cells), cells
    number = np.arange(model.n_dofs // 3).reshape(n, n_r + 1, n_z + 1)
    bore = number[:, 0, 1:-1]
    held = 3 * number[:, -1, 1:-1, None] + np.arange(3)
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    theta = 2 * np.pi / n * np.arange(n)
    R = np.zeros((model.n_dofs, bore.size))
    for axis, along in enumerate((np.cos(theta), np.sin(theta))):
        R[3 * bore.ravel() + axis, np.arange(bore.size)] = np.repeat(along, n_z - 1)
    C = R[free].T @ splu(model.K[free][:, free].tocsc()).solve(R[free])
    return C, theta, model.points[bore[0], 2]


def pressure(h, active):
    """Pressure (n, m + 1) of a film by differences; where it would pull it is zero (Reynolds)."""
    n, m = h.shape[0], h.shape[1] - 1
    dx, dz, inside = np.pi * DIAMETER / n, LENGTH / m, np.s_[:, 1:-1]
    east = ((h + np.roll(h, -1, 0)) / 2)[inside] ** 3 / dx**2
    up = ((h[:, 1:] + h[:, :-1]) / 2) ** 3 / dz**2
    k = np.arange(n * (m - 1)).reshape(n, m - 1)
    source = 6 * OIL * SPEED * DIAMETER / 2 * (np.roll(h, 1, 0) - np.roll(h, -1, 0))[inside]
    links = [(east, k, np.roll(k, -1, 0)), (up[:, 1:-1], k[:, :-1], k[:, 1:])]
    by, one, two = (np.concatenate([x[side].ravel() for x in links]) for side in range(3))
    A = coo_matrix((-by, (one, two)), (k.size, k.size))
    A = (A + A.T).tocsr()
    A = A + diags((east + np.roll(east, 1, 0) + up[:, 1:] + up[:, :-1]).ravel())
    b, p = source.ravel() / (2 * dx), np.zeros(k.size)
    for _ in range(50):
        p[:] = 0.0
        p[active] = spsolve(A[active][:, active].tocsc(), b[active])
        now = np.where(active, p > 0.0, A @ p < b)
        if (now == active).all():
            break
        active = now
    return np.pad(p.reshape(n, m - 1), ((0, 0), (1, 1))), active


def elastic_film(at, E, cells, n=96, m=16):
    """Force on a journal [N], largest pressure [Pa] and thinnest film [m], by a fixed point."""
    angle = (2 * np.pi / n * np.arange(n))[:, None]
    C, P = np.zeros((0, 0)), np.zeros((n * m + n, 0))
    if E is not None:
        C, theta, z = compliance(E, cells)
        ring_of = np.vstack([np.eye(len(theta)), np.eye(len(theta))[:1]])
        around = CubicSpline(np.append(theta, 2 * np.pi), ring_of, bc_type="periodic")
        places = 2 * np.pi / n * np.arange(n), np.linspace(z[0], z[-1], m + 1)
        P = np.kron(around(places[0]), CubicSpline(z, np.eye(len(z)))(places[1]))
    rigid = CLEARANCE - at[0] * np.cos(angle) - at[1] * np.sin(angle) + np.zeros((n, m + 1))
    area = np.pi * DIAMETER / n * LENGTH / m
    w, active = 0 * rigid, np.ones(n * (m - 1), dtype=bool)
    for _ in range(200):
        p, active = pressure(rigid + w, active)
        moved = (P @ (C @ (P.T @ p.ravel()))).reshape(p.shape) * area
        if np.abs(moved - w).max() < 1e-7 * CLEARANCE:
            break
        w += 0.4 * (moved - w)
    force = -area * np.array([(p * np.cos(angle)).sum(), (p * np.sin(angle)).sum()])
    return force, p.max(), (rigid + w).min()


def test_a_soft_bush_has_the_film_of_an_elastic_program():
    """Differences for Reynolds, all nodes of the bush: what is left are the cells of both films."""
    cells, E = (48, 2, 10), SOFT
    for body, modulus in ((None, None), (bush(rom.FourierLegendre(6, 4), E, cells), E)):
        at, found = at_rest(body, bearing((96, 16)))
        coarse, fine = (elastic_film(at, modulus, cells, n, n // 6) for n in (96, 192))
        force, largest, thinnest = (b + (b - a) / 3 for a, b in zip(coarse, fine, strict=True))
        # the film of 96 x 16 cells alone errs by 0.8 % of its load, as finer ones of both show
        assert_allclose(force, [0.0, -LOAD[1]], atol=0.011 * -LOAD[1])
        assert abs(force[0]) < 1e-3 * -LOAD[1]
        assert found.pressure[0] == pytest.approx(largest, rel=2e-3)
        assert found.thinnest[0] == pytest.approx(thinnest, rel=2e-3)
    # what the record says of the bore is what the film is open by, its thinnest place at an edge
    (x, y), grid = found.motion[0, :2], bearing((96, 16)).grid.angle[0]
    gap = CLEARANCE - x * grid[:, :1] - y * grid[:, 1:] + found.opening[0]
    assert gap.min() == pytest.approx(found.thinnest[0], rel=2e-2)
    assert found.opening.max() > 0.05 * CLEARANCE


def test_more_functions_come_closer_to_all_nodes():
    """The load that the other program bears where the journal rests, across it and at its peak."""
    cells, errors = (48, 2, 10), []
    for functions in ((1, 0), (2, 1), (4, 2), (6, 4)):
        at, found = at_rest(bush(rom.FourierLegendre(*functions), SOFT, cells), bearing((96, 16)))
        force, largest, _ = elastic_film(at, SOFT, cells)
        errors.append((abs(force[0] / LOAD[1]), abs(found.pressure[0] / largest - 1)))
    by_force, by_peak = np.array(errors).T
    assert np.all(np.diff(by_force) < 0)
    assert by_force[0] > 0.05 and by_force[3] < 1e-3
    assert by_peak[0] > 0.03 and by_peak[3] < 2e-3


@cache
def liner(E):
    """A thin liner in a rigid housing, which gives way by t p (1 - nu^2) / E with nu = 0.3.

    That of a strip that slides on its back and bears no stress along itself. In a tube without
    lateral contraction a layer gives way by the logarithm of its radii.
    """
    R, t, nu = 0.05, 0.005, 0.3
    material = rom.Material(E=E / (1 - nu**2) * R / t * np.log(1 + t / R), nu=0.0, rho=2000.0)
    return rom.reduce(
        tube(R, R + t, 0.1, (48, 1, 4), material, ends=0), method=rom.Guyan(), certify=False,
        interfaces={"bore": rom.FourierLegendre(6, 0), "rim": "rbe2"}, reference="rim",
    )  # fmt: skip


@pytest.mark.parametrize(("load", "E", "eccentricity", "attitude", "largest"), ROSS)
def test_a_bearing_with_a_liner_is_that_of_ross(load, E, eccentricity, attitude, largest):
    """ROSS 631a249, two pads of 160 degrees on strips in plane strain that feel the mean over z."""
    grooves = [Groove(angle, np.radians(20)) for angle in (0.0, np.pi)]
    b = JournalBearing(0.1, 0.1, 1e-4, grooves, cells=(180, 20))
    at, found = at_rest(liner(E) if E else None, b, (0.0, -load), 100 * np.pi)
    assert np.hypot(*at) / b.clearance == pytest.approx(eccentricity, rel=3e-3)
    assert np.degrees(np.arctan2(at[0], -at[1])) == pytest.approx(attitude, abs=0.8)
    assert found.pressure[0] == pytest.approx(1e6 * largest, rel=8e-3)


@pytest.mark.parametrize(("given", "words"), [
    ({"kind": "rbe2"}, "'bore' of body 'bush', has no functions by which it could deform"),
    ({"kind": "rbe3"}, "has no functions"),
    ({"on": "ground"}, "'mainbearing'.* has no functions"),
    ({"on": "block"}, "'mainbearing'.* has no functions"),
    ({"bearing": bearing(aligned=True)}, "'mainbearing'.* deforms, and the film of an aligned"),
    ({"axis": (1, 0, 0)}, "'mainbearing'.* is no bore of it: its nodes lie .* mm from the axis"),
    ({"bearing": JournalBearing(0.05, LENGTH, CLEARANCE)}, "a radius of 25 mm"),
    ({"bearing": JournalBearing(DIAMETER, 0.05, CLEARANCE)}, "ends 5 mm before the bearing does"),
])  # fmt: skip
def test_what_is_no_elastic_bush_is_refused_by_name(given, words):
    given = {"kind": rom.FourierLegendre(1, 1), "on": "bush.bore", "bearing": bearing()} | given
    mech, solid = rom.Mechanism(gravity=ORIGIN), {"mass": 1.0, "inertia": (0.1,) * 3, "at": ORIGIN}
    mech.add_flexible("bush", bush(given.pop("kind"), SOFT, (16, 1, 6)), at=ORIGIN)
    for name in ("shaft", "block"):
        mech.add_rigid(name, **solid)
    add, ends = mech.journal_bearing, ("shaft", given.pop("on"))
    refuses(rom.ConfigError, words, add, "mainbearing", *ends, **SOFT_FILM | given)


ENTRY = """
[bodies.bush]
file = "bush.rom.npz"
at = [0, 0, 0]
[bodies.shaft]
mass = 1
inertia = [0.1, 0.1, 0.1]
at = [0, 0, 0]
markers = { middle = [0, 0, 0] }
[journal_bearings.film]
between = ["shaft.middle", "bush.bore"]
axis = [0, 0, 1]
oil = { viscosity = 0.02 }
elastic_bush = true
bearing = { diameter = "40 mm", length = "40 mm", clearance = "40 um" }
[simulation]
t_end = 1
"""


def test_a_file_asks_for_an_elastic_bush(tmp_path):
    body = bush(rom.FourierLegendre(1, 1), SOFT, (16, 1, 6))
    rom.save(body, tmp_path / "bush.rom.npz")
    (tmp_path / "m.toml").write_text(ENTRY)
    made = rom.read_mechanism(tmp_path / "m.toml").mechanism().journal_bearings["film"]
    mech = rom.Mechanism()
    mech.add_flexible("bush", body, at=ORIGIN)
    mech.add_rigid("shaft", mass=1.0, inertia=(0.1,) * 3, at=ORIGIN)
    mech.journal_bearing("film", "shaft", "bush.bore", bearing=bearing((120, 8)), **SOFT_FILM)
    same = mech.journal_bearings["film"].bore
    assert_allclose(made.bore[0] @ made.bore[1], same[0] @ same[1], atol=1e-12)
    assert np.abs(same[0] @ same[1]).max() > 1e-6


@pytest.mark.parametrize(("kind", "given", "instead", "words"), [
    ("rbe2", "", "", "m.toml:10: the bush of bearing 'film'.* has no functions"),
    (None, "[0, 0, 1]", "[1, 0, 0]", "m.toml:10: the bush of bearing 'film'.* is no bore of it"),
    (None, "40 mm", "50 mm", "m.toml:10: the bush of bearing 'film'.* a radius of 25 mm"),
    (None, "40 um", "-40 um", "m.toml:15: journal_bearings.film.bearing.clearance = '-40 um'"),
    (None, "true", '"yes"', "m.toml:14: journal_bearings.film.elastic_bush = 'yes' must be true"),
])  # fmt: skip
def test_a_file_that_asks_in_vain_is_told_where(kind, given, instead, words, tmp_path):
    kind = kind or rom.FourierLegendre(1, 1)
    rom.save(bush(kind, SOFT, (16, 1, 6)), tmp_path / "bush.rom.npz")
    (tmp_path / "m.toml").write_text(ENTRY.replace(given, instead, 1) if given else ENTRY)
    refuses(rom.ConfigError, words, lambda: rom.read_mechanism(tmp_path / "m.toml").mechanism())
