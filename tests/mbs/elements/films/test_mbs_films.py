"""Oil films between bodies: in the frame of the bush, with momentum, power and tangents."""

import numba
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import rom
from cases.mbs.films import MOTION, ORIGIN, RATE, SPEED, VISCOSITY, Pair, held_rotor, on_ground
from cases.mbs.mechanisms import prepared, random_body, tangents_at
from cases.mbs.tangents import difference, forces_at, shifted
from cases.refusals import refused, refuses
from rom.components.journal_bearing import film
from rom.components.journal_bearing.films.cells import SPIN_COLUMN, cells_of
from rom.components.journal_bearing.films.journals import FIRST_CONTENT, KNOWN, TIME
from rom.components.journal_bearing.films.kinematics import journal_motion
from rom.components.journal_bearing.films.slopes import solve_film
from rom.mbs import Groove, JournalBearing, iso_vg
from rom.rotation import exp, matrix

INCLINED = (0.3, -0.5, 0.8), (0.7, 0.1, -0.4)  # rotation vectors of a journal and its bush
SLIDE = np.array([0.7, -1.1, 0.4])
GROOVES = [Groove(1.2, 0.3, 1e5, share=0.7)]
LAWS = ["none", "reynolds", "jfo"]


def bearing(law="reynolds", cells=(60, 8), grooves=GROOVES, slender=1.0, **more):
    return JournalBearing(0.1, 0.1 * slender, 1e-4, grooves, cells=cells, cavitation=law, **more)


def turned_by(vector):
    return matrix(exp(np.asarray(vector)))


@numba.njit
def motion_of(axes, relative):
    return journal_motion(axes, relative)


def test_the_rate_of_a_journal_is_that_of_its_motion():
    """Far from the middle plane and much inclined, where terms of second order count."""
    spins = np.array([3.0, -2.0, 40.0]), np.array([-1.0, 2.5, 4.0])  # of the journal, of the bush

    def motion(t):
        B, A = (turned_by(t * O) @ turned_by(at) for O, at in zip(spins, INCLINED, strict=True))
        axes = (*A.T, B[:, 2])
        parts = np.array([0.3, -0.2, 0.5]) + t * SLIDE, SLIDE, *spins
        return motion_of(*(tuple(tuple(v) for v in some) for some in (axes, parts)))

    _, rate, spin = motion(0.0)
    (ahead, *_), (behind, *_) = motion(1e-6), motion(-1e-6)
    assert_allclose(rate, np.subtract(ahead, behind) / 2e-6, rtol=1e-7)
    assert spin == pytest.approx((spins[0] - spins[1]) @ turned_by(INCLINED[1])[:, 2])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("along", [0.0, 0.02])
def test_loads_are_those_of_the_film_in_the_bush(law, along):
    b = bearing(law)
    f = film(b, MOTION, RATE, speed=SPEED, viscosity=VISCOSITY)
    A = turned_by([0.3, -0.5, 0.8])
    pair = Pair(b, A, (0.3, -0.2, 0.1), along=along)
    (on_journal, on_bush), power = pair.loads(pair.velocities())
    force, moment = A.T @ on_journal[:3], A.T @ on_journal[3:]
    n = A.T @ pair.B[:, 2]
    # the force on an axis that leans has a part along the bush, so that it does no work along it
    slopes = MOTION[[3, 2]] * [1, -1]
    assert_allclose(force, [*f.force[:2], -f.force[:2] @ slopes], rtol=1e-8)
    middle = moment + np.cross(along * n / n[2], force)
    assert_allclose(middle[:2], f.force[2:], rtol=1e-6)
    # pressure has no moment about the axis of the journal, and friction one about that of the bush
    about = middle[2] + f.force[2:] @ (MOTION[[3, 2]] * [1, -1])
    assert about == pytest.approx(-f.friction_torque, rel=1e-7)
    assert power == pytest.approx(f.dissipated, rel=1e-8)
    assert_allclose(on_journal[:3] + on_bush[:3], 0, atol=1e-9 * np.abs(on_journal).max())
    total = on_journal[3:] + on_bush[3:] + np.cross(pair.arm, on_journal[:3])
    assert_allclose(total, 0, atol=1e-12 * np.abs(on_journal).max())


@pytest.mark.parametrize("law", LAWS)
def test_a_bush_that_moves_and_turns_feels_its_film_alike(law):
    pair = Pair(bearing(law), turned_by([0.3, -0.5, 0.8]))
    still, power = pair.loads(pair.velocities())
    carried = np.array([3.0, -2.0, 1.0, 20.0, -30.0, 50.0])
    moved, same = pair.loads(pair.velocities(bush=carried))
    assert_allclose(moved, still, rtol=1e-7, atol=1e-9 * np.abs(still).max())
    assert same == pytest.approx(power, rel=1e-7)


@pytest.mark.parametrize("law", LAWS)
def test_backwards_is_the_mirror_image(law):
    """Y mirrored: the spin, tilts about X and angles of grooves change their signs."""
    mirror = np.array([1.0, -1.0, -1.0, 1.0])
    b = bearing(law)
    other = bearing(law, grooves=[Groove(-g.angle, g.width, g.pressure, g.share) for g in GROOVES])
    (on_journal, _), power = (pair := Pair(b)).loads(pair.velocities())
    back = Pair(other, motion=MOTION * mirror)
    (mirrored, _), lost = back.loads(back.velocities(RATE * mirror, -SPEED))
    signs = [1, -1, 1, -1, 1, -1]
    assert_allclose(mirrored, on_journal * signs, rtol=1e-8, atol=1e-8)
    assert lost == pytest.approx(power, rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_an_aligned_film_does_not_see_tilts(law):
    b = bearing(law, grooves=[Groove(1.2, 0.3, 1e5)], aligned=True)
    upright = np.array([1.0, 1.0, 0.0, 0.0])
    f = film(b, MOTION * upright, RATE * upright, speed=SPEED, viscosity=VISCOSITY)
    (on_journal, _), power = (pair := Pair(b)).loads(pair.velocities())
    assert_allclose(on_journal[:2], f.force[:2], rtol=1e-7)
    # that of friction is about the axis of the bush
    assert_allclose(on_journal[3:], [0, 0, -f.friction_torque], atol=1e-9)
    assert power == pytest.approx(f.dissipated, rel=1e-7)


def test_films_that_do_not_turn_are_squeezed():
    """Short bearing: p = 6 mu (dh/dt) / h^3 (z^2 - L^2/4); where it opens there is none.

    Long one with a full film: 12 pi mu L (R/c)^3 / (1 - e^2)^1.5.
    """
    e, speed = 0.5, 2e-3
    b = bearing(slender=0.01, cells=(180, 40), grooves=(), aligned=True)
    pair = Pair(b, motion=np.array([e * 1e-4, 0, 0, 0]))
    (on_journal, _), power = pair.loads(pair.velocities(np.array([speed, 0, 0, 0]), 0.0))
    half = quad(lambda t: np.cos(t) ** 2 / (1 - e * np.cos(t)) ** 3, -np.pi / 2, np.pi / 2)[0]
    C = VISCOSITY * b.radius * b.length**3 / b.clearance**3 * half
    assert_allclose(on_journal[:2], [-C * speed, 0.0], rtol=1e-3, atol=1e-6 * C * speed)
    assert power == pytest.approx(-on_journal[0] * speed, rel=1e-12)
    b = bearing("none", (360, 8), (), 40.0, aligned=True)
    pair = Pair(b, motion=np.array([e * 1e-4, 0, 0, 0]))
    (on_journal, _), _ = pair.loads(pair.velocities(np.array([speed, 0, 0, 0]), 0.0))
    C = 12 * np.pi * VISCOSITY * b.length * (b.radius / b.clearance) ** 3 / (1 - e**2) ** 1.5
    assert on_journal[0] == pytest.approx(-C * speed, rel=2e-2)  # its ends leak


def test_without_spin_and_motion_nothing_happens():
    for law in LAWS:
        pair = Pair(bearing(law, grooves=[Groove(1.0)]))
        found, power = pair.loads(pair.velocities(0 * RATE, 0.0))
        assert_allclose(found, 0.0, atol=1e-9)
        assert power == 0.0


def solved(b, opening=0.0, opening_rate=0.0, **state):
    """Pressure and answers of the cells of one film, in their units."""
    films = cells_of([b])
    films.state[0, SPIN_COLUMN] = 1.0
    films.opening[0], films.opening_rate[0] = np.ravel(opening), np.ravel(opening_rate)
    for at, values in state.items():
        films.state[0, {"motion": slice(4), "rate": slice(4, 8)}[at]] = values
    assert solve_film(films, 0, 1.0) > 0
    return films.P[0].copy(), films.answer[0].copy()


def test_a_bush_that_gives_way_is_one_that_is_wider_or_moves():
    """Openings of cells: all alike as a wider bore; their rates as those of a journal."""
    motion = [0.4, 0.3, 0.1, -0.2]
    wider = bearing("jfo", bore=lambda angles: 1.2 + 0 * angles)
    angle = bearing().grid.angle[0]
    rate = np.tile(-(0.3 * angle[:, 0] - 0.2 * angle[:, 1])[:, None], 8)
    pairs = [(solved(bearing("jfo"), opening=0.2, motion=motion), solved(wider, motion=motion)),
             (solved(bearing(), opening_rate=rate, motion=motion),
              solved(bearing(), motion=motion, rate=[0.3, -0.2, 0, 0]))]  # fmt: skip
    for found, known in (both for pair in pairs for both in zip(*pair, strict=True)):
        assert_allclose(found, known, rtol=1e-10, atol=1e-10)
    # a bump where the film is thin changes the load, one whose cells have no pressure does not
    # of one column: its neighbours see half of it at the faces between
    bump, grid, h = np.zeros((60, 8)), bearing().grid, {}
    bump[7] = 0.05 * (1 + grid.Z)
    films = cells_of([bearing()])
    films.opening[0], films.state[0, :4], films.state[0, SPIN_COLUMN] = bump.ravel(), motion, 1.0
    assert solve_film(films, 0, 1.0) > 0
    for face, cells in ((0, films.middle), (1, films.behind)):
        c, s, Z = grid.angle[face, :, :1], grid.angle[face, :, 1:], grid.Z
        h[face] = cells[0].reshape(60, 8) - (1 - (0.4 - 0.2 * Z) * c - (0.3 - 0.1 * Z) * s)
    assert_allclose(h[0][6:9], bump[6:9], atol=1e-14)
    assert_allclose(h[1][5:9], [0 * grid.Z, bump[7] / 2, bump[7] / 2, 0 * grid.Z], atol=1e-14)
    # and its slope along the width goes on to the ends
    (c, s), Z = grid.angle[0, 7], grid.Z_face
    side = films.side[0].reshape(60, 9)[7] - (1 - (0.4 - 0.2 * Z) * c - (0.3 - 0.1 * Z) * s)
    assert_allclose(side, 0.05 * (1 + Z), atol=1e-14)


@pytest.mark.parametrize("law", [*LAWS, "table"])
@pytest.mark.parametrize("spin", [SPEED, -SPEED])
@pytest.mark.parametrize("passed", [0.0, 1e-3])
def test_tangents_are_the_derivatives(law, spin, passed):
    rng = np.random.default_rng(3)
    b = bearing("reynolds", (40, 3), [Groove(1.2)]) if law == "table" else bearing(law)
    pair = Pair(b, turned_by(rng.normal(size=3)), (0.3, -0.2, 0.1), along=0.01,
                tabulated=law == "table")  # fmt: skip
    v = pair.velocities(spin=spin, bush=0.2 * rng.normal(size=6))
    packed, W = pair.packed, pair.W
    pair.loads(v)
    first = len(packed.places.coordinates)
    W.base[first:] = W.fresh
    W.base[first + KNOWN], W.base[first + TIME] = float(passed > 0.0), -passed
    W.base[first + FIRST_CONTENT :] *= 0.97

    def force(dq, dv):
        return forces_at(packed, W, shifted(packed, packed.q, dq), v + dv)

    step = np.tile([1e-10, 1e-10, 1e-10, 1e-9, 1e-9, 1e-9], 2)
    stiff = np.array([(force(e, 0 * v) - force(-e, 0 * v)) / (2 * d)
                      for e, d in zip(np.diag(step), step, strict=True)]).T  # fmt: skip
    loss = difference(lambda x: force(0 * v, x), 12, 1e-8)
    tangents_at(packed.system, W, packed.q, v, 0 * v, np.zeros(0), (0.0, 0.0, 1.0))
    assert np.abs((W.Kt - stiff) / np.abs(stiff).max(axis=1, keepdims=True)).max() < 1e-5
    tangents_at(packed.system, W, packed.q, v, 0 * v, np.zeros(0), (0.0, 1.0, 0.0))
    assert_allclose(W.S, loss, atol=1e-6 * np.abs(loss).max() + 2e-5)


@pytest.mark.parametrize("side", [0, 1])
def test_tangents_of_bodies_that_bend_are_the_derivatives(side):
    """What turns moves where it bends, too: that is damped."""
    rng = np.random.default_rng(5)
    soft = random_body(rng)
    mech = rom.Mechanism(gravity=ORIGIN)
    point = np.asarray(soft.markers["a"].point)
    part = mech.add_flexible("soft", soft, at=-point, omega=rng.normal(size=3))
    stiff = mech.add_rigid("stiff", mass=1.0, inertia=(0.1,) * 3, at=(2e-5, 1e-5, 0))
    ends = [part.marker("a"), stiff.marker(ORIGIN)]
    given = {"axis": (0, 0, 1), "bearing": bearing(), "oil": VISCOSITY}
    mech.journal_bearing("film", *ends[:: 1 - 2 * side], **given)
    packed, W = prepared(mech)
    v = packed.v + 1e-3 * rng.normal(size=packed.v.size)
    v[:3] = np.cross(v[3:6], -point)  # the marker stands still, but for what bends
    tangents_at(packed.system, W, packed.q, v, 0 * v, np.zeros(0), (0.0, 0.0, 1.0))
    K = W.Kt.copy()

    def force(dq):
        return forces_at(packed, W, shifted(packed, packed.q, dq), v)

    found = np.array([(force(d) - force(-d)) / 2e-10 for d in 1e-10 * np.eye(v.size)]).T
    assert_allclose(K, found, atol=2e-6 * np.abs(found).max())
    assert np.abs(K[:, 6:10]).max() > 1e-2 * np.abs(K).max()


@pytest.mark.parametrize("tabulated", [False, True])
def test_two_bodies_on_a_film_keep_momentum_and_energy(tabulated):
    b = bearing(cells=(40, 4), grooves=[Groove(2.0, 0.2)])
    mech = rom.Mechanism(gravity=ORIGIN)
    own = {"mass": 2.0, "inertia": (0.01, 0.02, 0.03), "velocity": (0.4, 0, 0)}
    mech.add_rigid("journal", at=(0.3e-4, 0, 0), omega=(0.1, 0.05, 100.0), **own)
    mech.add_rigid("bush", at=ORIGIN, omega=(0.1, 0.05, -20.0), **own)
    law = {"axis": (0, 0, 1), "bearing": b, "oil": 0.01, "tabulated": tabulated}
    mech.journal_bearing("film", "journal", "bush", **law)
    sol = rom.simulate(mech, t_end=0.02, dt=5e-6, method="bdf", save_every=20, progress=False)
    p, L = sol.momentum
    assert_allclose(p, np.tile([1.6, 0, 0], (len(p), 1)), atol=1e-10)
    assert_allclose(L, np.tile(L[0], (len(L), 1)), atol=1e-6 * np.abs(L[0]).max())
    assert sol.energy.damping[-1] > 1.0
    E = sol.energy.kinetic + sol.energy.damping
    assert_allclose(E, E[0], rtol=1e-6)
    assert rom.audit(sol).ok


def put(**given):
    return lambda: on_ground(bearing(), name="mainbearing", **given)


test_what_no_bearing_is_is_refused_by_name = refused(
    (put(at=(1.1e-4, 0, 0)), "journal .*'mainbearing' touches its bush at the start"),
    (put(at=(0.98e-4, 0, 0), roughness=5e-6), "touches its bush at the start"),
    (put(roughness=2e-4), "roughness of bearing 'mainbearing'"),
    (put(axis=ORIGIN), "axis of mainbearing has length zero"),
    (put(reference=(0, 0, 2)), "reference of bearing 'mainbearing'"),
    (put(oil=0.0), "oil of bearing 'mainbearing' .* = 0 must"),
    (put(oil=-0.03), "oil of bearing 'mainbearing' .* = -0.03 must"),
    (put(oil=iso_vg(46)), "'mainbearing' has an oil; give its inlet"),
    (put(inlet=40.0), "'mainbearing' has an inlet temperature, but"),
    error=rom.ConfigError,
)


def test_a_body_is_no_bearing_of_itself():
    mech = rom.Mechanism()
    mech.add_rigid("shaft", mass=1.0, inertia=(0.1,) * 3, at=ORIGIN)
    given = {"axis": (0, 0, 1), "bearing": bearing(), "oil": 0.03}
    words = "'b' connects body 'shaft' with itself"
    refuses(rom.ConfigError, words, mech.journal_bearing, "b", "shaft", "shaft", **given)


def test_a_journal_that_hits_its_bush_or_is_shot_through_it_is_named_with_the_time():
    mech = on_ground(bearing(), name="mainbearing", oil=1e-6)
    mech.force("blow", mech.parts["shaft"].marker(ORIGIN), (5e3, 0, 0))
    words = r"at t = 0\.00.*touches its bush in 'mainbearing'"
    refuses(rom.SolverError, words, rom.simulate, mech, t_end=0.01, dt=1e-4)
    mech = on_ground(bearing(), name="mainbearing", oil=1e-6, turning=0.0, way=(1e4, 0, 0))
    refuses(rom.SolverError, "'mainbearing'", rom.simulate, mech, t_end=1e-3, dt=1e-4)


def test_no_film_carries_more_than_there_is_room_for():
    mech = held_rotor(bearing(grooves=()), (-1e12, 0), speed=SPEED, oil=1e-6)
    errors = rom.SolverError, rom.ModelError
    refuses(errors, "gap of 'film' open", rom.equilibrium, mech, spin={"turn": SPEED})


@pytest.mark.parametrize("more", [{"dt": 1e-4}, {"dt": 2e-5, "method": "bdf"}], ids=str)
def test_steps_predicted_through_the_bush_are_shortened(more):
    """A light shaft under a sudden load, which would move it by more than its play in a step."""
    b = JournalBearing(0.04, 0.04, 4e-5, cells=(60, 8))
    load, mass, speed = (0.0, -5e4), 0.1, 300.0
    assert 0.5 * load[1] / mass * 2e-5**2 < -b.clearance
    mech = held_rotor(b, load, speed=speed, oil=0.02, mass=mass)
    moved = rom.simulate(mech, t_end=0.03, **more)
    rests = rom.equilibrium(mech, spin={"turn": speed})
    assert_allclose(moved.q[-1][:2], rests.q[:2], atol=1e-4 * b.clearance)
    film = moved.journal_bearing("film")
    assert film.thinnest.min() > 0.0
