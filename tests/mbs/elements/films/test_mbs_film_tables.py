"""Films read from tables: as those that are solved, to what tables and small tilts leave out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.films import NONE, ORIGIN, Pair, held_rotor, on_ground, resting
from cases.mbs.mechanisms import prepared, residual_at, tangents_at
from cases.refusals import refused, refuses
from rom.components.journal_bearing.films.tabulated import MAX_TILT_SHARE

SIDES = [rom.mbs.Groove(np.pi / 2, 0.35), rom.mbs.Groove(-np.pi / 2, 0.35)]
SPEED, OIL, CLEARANCE = 100.0, 0.03, 1e-4


def bearing(law="reynolds", grooves=SIDES, **more):
    return rom.mbs.JournalBearing(0.1, 0.05, CLEARANCE, grooves, law, cells=(60, 4), **more)


def loads(b, motion, rate, spin, **more):
    """(6,) of the journal that moves so, the power, and what belongs to the film."""
    pair = Pair(b, motion=motion, **more)
    (found, _), power = pair.loads(pair.velocities(rate, spin))
    return found, power, pair.table


def random_state(rng, tilt):
    """Motion, rate and spin; tilts close an end by that share of the film at most."""
    e, around = np.sqrt(rng.uniform(0, 0.9**2)), rng.uniform(0, 2 * np.pi)
    lean = 2 * tilt * (1 - e) * CLEARANCE / 0.05
    turn = rng.uniform(0, 2 * np.pi)
    place = e * CLEARANCE * np.array([np.cos(around), np.sin(around)])
    rate = np.array([*rng.normal(size=2) * 5e-3, *rng.normal(size=2) * tilt * 5e-2])
    motion = np.array([*place, lean * np.cos(turn), lean * np.sin(turn)])
    return motion, rate, rng.normal() * SPEED


@pytest.mark.parametrize("b", [bearing(), bearing("none", aligned=True)], ids=["wide", "aligned"])
def test_a_table_has_the_film_that_is_solved(b):
    """Forces, friction and power; oil that leaves, and the largest pressure but for some places."""
    rng, off, peaks = np.random.default_rng(4), [], []
    for _ in range(40):
        state = random_state(rng, 0.0)
        known, lost, solved = loads(b, *state)
        found, power, read = loads(b, *state, tabulated=True)
        scale = [np.linalg.norm(known[:2])] * 2 + [abs(known[5])]
        off.append(np.abs(known - found)[[0, 1, 5]] / scale)
        assert power == pytest.approx(lost, rel=5e-3)
        assert read.thinnest[0] == pytest.approx(solved.thinnest[0], rel=0.05)  # between cells
        peaks.append(abs(read.largest[0] / solved.largest[0] - 1))
        assert read.flow[0] == pytest.approx(solved.flow[0], rel=1e-2)
    off = np.array(off)
    assert np.median(off, axis=0).max() < 1e-3
    assert off.max() < 1e-2
    # one peak takes over from another
    assert np.median(peaks) < 5e-3 and max(peaks) < 0.15


def test_what_a_table_leaves_out_of_tilts_falls_with_their_square():
    """Forces by the square of a tilt, moments by its cube."""
    b, ratios, share = bearing("none"), [], []
    rng = np.random.default_rng(5)
    for _ in range(12):
        motion, rate, spin = random_state(rng, 0.2)
        off = []
        for tilt in (1.0, 0.5):
            state = motion * [1, 1, tilt, tilt], rate * [1, 1, tilt, tilt], spin
            upright = motion * [1, 1, 0, 0], rate * [1, 1, 0, 0], spin
            known, flat = (loads(b, *one)[0] for one in (state, upright))
            found = loads(b, *state, tabulated=True)[0]
            off.append([np.linalg.norm(known[:2] - flat[:2]), np.linalg.norm((known - found)[3:5])])
            share.append(np.linalg.norm((known - found)[3:5]) / np.linalg.norm(known[3:5]))
            assert_allclose(found[:2], flat[:2], atol=2e-3 * np.linalg.norm(flat[:2]))
        ratios.append(np.divide(*off))
    assert_allclose(np.median(ratios, axis=0), [4.0, 8.0], rtol=0.15)
    assert np.median(share) < 0.05


def test_slopes_of_all_answers_are_those_of_the_table():
    b, rng, d = bearing(), np.random.default_rng(8), 1e-5
    for _ in range(3):
        motion, rate, spin = random_state(rng, 0.2)
        x, scale = np.array([*motion, *rate, spin]), np.array([*b.scale, *b.scale, 1.0])

        def answers(state):
            pair = Pair(b, motion=state[:4], tabulated=True)
            v = pair.velocities(state[4:8], state[8])
            pair.loads(v)
            return pair, v, pair.table.films.answer[0].copy()

        steps = np.diag(d * scale * [1, 1, 1, 1, 100, 100, 100, 100, 100])
        found = [(answers(x + e)[2] - answers(x - e)[2]) / (2 * e.sum()) for e in steps]
        pair, v, _ = answers(x)
        tangents_at(pair.packed.system, pair.W, pair.packed.q, v, 0 * v, NONE, (0.0, 1.0, 1.0))
        known = pair.table.films.slope[0, :, :9]
        for columns in (slice(4), slice(4, 8), slice(8, 9)):
            part = (np.array(found).T * scale)[:, columns]
            largest = np.abs(part).max(axis=1, keepdims=True)
            assert_allclose(known[:, columns] / largest, part / largest, atol=1e-5)


def test_a_full_film_is_that_of_the_cells_up_to_the_last_node():
    """Where it is a spline of few waves: along the axes of the table 1e-4 up to 0.985."""
    b = bearing("none", aligned=True)
    for e, off in ((0.9, 2e-5), (0.985, 3e-4), (0.9893, 3e-3)):
        for angle in np.pi / 2 * np.arange(4):
            motion = e * CLEARANCE * np.array([np.cos(angle), np.sin(angle), 0, 0])
            state = motion, 1e-3 * np.array([0.6, 0.8, 0, 0]), 20.0
            known, found = (loads(b, *state, tabulated=t)[0][:2] for t in (False, True))
            assert_allclose(found, known, atol=off * np.linalg.norm(known))
    # the place is stretched by a series near the middle: no step where it ends
    places = np.outer([0.009999999, 0.010000001], [CLEARANCE, 0, 0, 0])
    near, far = (loads(b, x, np.zeros(4), SPEED, tabulated=True)[0][:2] for x in places)
    assert_allclose(far, near, atol=5e-6 * np.linalg.norm(near))


def test_every_film_has_its_own_table():
    wide, narrow = bearing(), rom.mbs.JournalBearing(0.1, 0.03, CLEARANCE, SIDES, cells=(40, 3))
    found = []
    for some in ((wide,), (narrow,), (wide, narrow)):
        mech = rom.Mechanism(gravity=ORIGIN)
        for k, b in enumerate(some):
            shaft = mech.add_rigid(f"shaft {k}", mass=1.0, inertia=(1.0,) * 3,
                                   at=(0.4 * CLEARANCE, 0, 0), omega=(0, 0, SPEED))  # fmt: skip
            mech.journal_bearing(f"film {k}", shaft.marker(ORIGIN), mech.ground.marker(ORIGIN),
                                 axis=(0, 0, 1), bearing=b, oil=OIL, tabulated=True)  # fmt: skip
        packed, W = prepared(mech)
        residual_at(packed.system, W, packed.q, packed.v, 0 * packed.v, NONE)
        (table,) = packed.elements.values()
        found.append(W.wrench[table.i].copy())
    assert_allclose(found[2], np.vstack(found[:2]), rtol=1e-12, atol=1e-12)
    assert np.linalg.norm(found[0] - found[1]) > 0.1 * np.linalg.norm(found[0])


def test_an_end_that_comes_too_close_leaves_the_table():
    """By the share of the film at its middle that is said, and beyond an eccentricity of 0.99."""
    lean = 2 * CLEARANCE / 0.05 * (1 - 0.5)
    for share in (0.98 * MAX_TILT_SHARE, 1.02 * MAX_TILT_SHARE):
        motion = np.array([0.5 * CLEARANCE, 0.0, 0.0, share * lean])
        found, _, film = loads(bearing(), motion, np.zeros(4), SPEED, tabulated=True)
        assert np.isfinite(found).all() == (share < MAX_TILT_SHARE)
        assert film.thinnest[0] == pytest.approx(0.5 * CLEARANCE * (1 - share), rel=1e-9)
    for e in (0.989, 0.991):
        motion = np.array([0.0, e * CLEARANCE, 0.0, 0.0])
        found, _, film = loads(bearing(), motion, np.zeros(4), SPEED, tabulated=True)
        assert np.isfinite(found).all() == (e < 0.99)
    mech = held_rotor(bearing(), (1e5, 0.0), speed=SPEED, oil=1e-3, tabulated=True)
    refuses(rom.SolverError, "'film'.* leaves its table", rom.simulate, mech, t_end=0.1, dt=1e-4)


def test_a_rotor_rests_and_is_stiff_as_on_the_film_that_is_solved():
    """Lund and Thomsen's bearing of two grooves: their table is held by the film itself."""
    for W in (300.0, 3000.0, 2e4):
        b, found = bearing(aligned=True), []
        for tabulated in (False, True):
            mech = held_rotor(b, (W, 0.0), speed=SPEED, oil=OIL, tabulated=tabulated)
            state, K, C = resting(mech, SPEED)
            found.append((state.q[:2] / CLEARANCE, K * CLEARANCE / W, C * CLEARANCE * SPEED / W))
        (place, K, C), (same, K_table, C_table) = found
        assert_allclose(same, place, atol=4e-3)
        # whose slopes jump as cells lose their pressure, by more than they are off from fine cells
        assert_allclose(K_table, K, atol=0.03 * np.abs(K).max())
        assert_allclose(C_table, C, atol=0.06 * np.abs(C).max())


def test_a_motion_is_that_of_the_film_that_is_solved():
    moved = []
    for tabulated in (False, True):
        mech = held_rotor(bearing(), (3000.0, 0.0), speed=SPEED, oil=OIL, tabulated=tabulated)
        sol = rom.simulate(mech, t_end=0.2, dt=2e-4, progress=False)
        moved.append(sol.journal_bearing("film"))
    assert np.ptp(moved[0].motion[:, 1]) > 0.2 * CLEARANCE
    assert_allclose(moved[1].motion, moved[0].motion, atol=2e-3 * CLEARANCE)
    assert_allclose(moved[1].power, moved[0].power, rtol=3e-3)


def test_the_temperature_is_that_of_the_film_that_is_solved():
    oil, found = rom.mbs.iso_vg(46), []
    for tabulated in (False, True):
        given = {"speed": 300.0, "oil": oil, "inlet": 40.0, "tabulated": tabulated}
        mech = held_rotor(bearing(), (3000.0, 0.0), **given)
        state = rom.equilibrium(mech, spin={"turn": 300.0})
        found.append(rom.mbs.snapshot(mech, state).journal_bearing("film"))
    assert found[0].temperature[0] > 42.0
    assert found[1].temperature[0] == pytest.approx(found[0].temperature[0], abs=0.02)


def read(elastic_bush=False, **sizes):
    b = bearing(**sizes)
    return lambda: on_ground(b, name="main", tabulated=True, elastic_bush=elastic_bush)


test_films_that_are_more_than_a_table_are_refused = refused(
    (read(law="jfo"), "'main' conserves its oil"),
    (read(grooves=[rom.mbs.Groove(0.0, 0.3, 1e5)]), "'main' has grooves with pressure"),
    (read(preload=0.3), "'main' has a bore that is not round"),
    (read(bore=rom.mbs.multilobe(3, 0.2)), "'main' has a bore that is not round"),
    (read(bore=lambda angle: 0.9 + 0 * angle), "'main' has a bore that is not"),
    (read(elastic_bush=True), "bush of bearing 'main' bends"),
    error=rom.ConfigError,
)


FILE = """
[bodies.shaft]
mass = 1
inertia = [0.1, 0.1, 0.1]
at = [0, 0, 0]
markers = { middle = [0, 0, 0] }
[journal_bearings.film]
between = ["shaft.middle", { ground = [0, 0, 0] }]
axis = [0, 0, 1]
oil = { viscosity = 0.03 }
tabulated = true
bearing = { diameter = "0.1 m", length = "50 mm", clearance = "0.1 mm", cells_around = 60, \
cells_along = 4, cavitation = "reynolds", grooves = { one = { angle = 1.5707963267948966, \
width = 0.35 }, two = { angle = -1.5707963267948966, width = 0.35 } } }
[simulation]
t_end = 1
"""


def test_a_file_asks_for_a_table(tmp_path):
    """The same as from Python, for a bearing of twice the size, too; and with its line if not."""
    (tmp_path / "m.toml").write_text(FILE)
    made = rom.read_mechanism(tmp_path / "m.toml").mechanism().journal_bearings["film"]
    mech = on_ground(rom.mbs.JournalBearing(0.2, 0.1, 1e-4, SIDES, cells=(60, 4)), tabulated=True)
    assert_allclose(made.table, mech.journal_bearings["film"].table, rtol=1e-9, atol=1e-12)
    (tmp_path / "m.toml").write_text(FILE.replace('"reynolds"', '"jfo"'))
    made = rom.read_mechanism(tmp_path / "m.toml").mechanism
    refuses(rom.ConfigError, "m.toml:7: bearing 'film' conserves its oil", made)
