"""Loads, tools and steps in time of sheets: closed forms of statics, impact and metal forming."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refuses
from cases.sheets import distorted, dofs
from rom.components import assumed_strain as sheets
from rom.components.assumed_strain import Actions, Drive, Load, Metal, Tool, Traction, sheet
from rom.components.assumed_strain.actions import prepared, touch
from rom.components.assumed_strain.implicit import _Way
from rom.components.masonry import Table, sine
from rom.errors import ConfigError, MeshError, RomWarning, SolverError

SMALL, SOFT = sheet(*distorted((2, 2))), Metal(1.0, 0.3)
FAR = [(5, 5), (9, 6), (5, 9)]  # a tool beside it, whose first face is tilted
PLANE = 2 / np.sqrt(3)  # yield in plane strain over that of a bar


def box(low, high):
    (a, b), (c, d) = low, high
    return [(a, b), (c, b), (c, d), (a, d)]


def block(n=(10, 10), size=(1.0, 1.0), **options):
    """Quarter of a block, and the dofs of its two planes of symmetry."""
    X, T = sheets.rectangle(n, box((0, 0), size))
    held = np.r_[dofs(X[:, 0] < 1e-9, (0,)), dofs(X[:, 1] < 1e-9, (1,))]
    return sheet(X, T, element="F1", **options), held


def pressed(body, held, metal, *, friction=0.0, share=0.3, steps=30):
    """Courses of a block that a platen presses from above, by a share of its height."""
    height = body.points[:, 1].max()
    way = ((0, 1), ((0, 0), (0, -share * height)))
    platen = Tool("platen", box((-3, height), (4, height + 1)), friction, way)
    times = np.linspace(0, 1, steps + 1)
    return sheets.quasi_static(body, metal, Actions(held, tools=[platen]), times)


@pytest.mark.parametrize("element", ["F1", "F3"])
def test_pressure_follows_the_edges_of_a_square(element):
    """Hencky's law in plane strain: -p lambda^2 = 2 ln(lambda) (K + mu / 3), on any mesh."""
    X, T = distorted()
    body, metal = sheet(X, T, element=element, state="plane strain"), Metal(10.0, 0.3)
    held = [0, 1, 2 * 4 + 1]  # a corner, and the height of the next
    for p in (3.0, -1.5):
        load = Traction(sheets.outer_sides(body), pressure=p, history=((0, 1), (0, 1)))
        actions = Actions(held, tractions=[load])
        course = sheets.quasi_static(body, metal, actions, np.linspace(0, 1, 6))
        size = course.x[-1].max(axis=0) - course.x[-1].min(axis=0)
        K, mu = metal.numbers[:2]
        assert_allclose(-p * size**2, 2 * np.log(size) * (K + mu / 3), rtol=1e-7)
        assert np.abs(course.reactions[-1]).max() < 1e-8 and course.iterations <= 6


@pytest.mark.parametrize("state", ["plane strain", "axisymmetric"])
def test_stiffness_of_turning_sides_is_the_derivative_of_their_forces(state):
    X, T = distorted((2, 2))
    body = sheet(X + np.array([0.5, 0.0]), T, state=state, thickness=0.7)
    acts = prepared(body, Actions((), tractions=[Traction(sheets.outer_sides(body)[:5], 3.0, 2.0)]))
    way, rng = _Way(body, Metal(1.0, 0.3), acts, None, 0.0), np.random.default_rng(0)
    x, K, now = body.points + 0.1 * rng.normal(size=X.shape), None, way.start(0.0, 0 * X)
    K = way.stiffness(now, way.trial(now, x, 0.0)).toarray()
    for dof in range(6, 12):
        up, down = x.copy(), x.copy()
        up.reshape(-1)[dof] += 1e-6
        down.reshape(-1)[dof] -= 1e-6
        change = way.trial(now, up, 0.0).whole - way.trial(now, down, 0.0).whole
        assert_allclose(K[:, dof], -change / 2e-6, atol=1e-6 * np.abs(K).max())


@pytest.mark.parametrize("size", [0.2, 1.0])
def test_a_shear_stress_along_the_edge_of_a_square_is_one_of_the_inside(size):
    """Equal shear along right and left, up and down, is pure shear: G times the angle."""
    X, T = sheets.rectangle((3, 3), box((0, 0), (size, size)))
    body, s = sheet(X, T, state="plane strain", thickness=0.3), 1e-5
    sides = sheets.outer_sides(body)
    upright = np.abs(np.diff(X[sides][:, :, 0], axis=1)[:, 0]) < 1e-9
    loads = [Traction(sides[upright], shear=s), Traction(sides[~upright], shear=-s)]
    metal = Metal(2.6, 0.3)
    course = sheets.quasi_static(body, metal, Actions([0, 1, 7], tractions=loads), [0, 1])
    u = (course.x[-1] - X) / size
    angle = u[3, 1] - u[0, 1] + u[12, 0] - u[0, 0]
    assert angle == pytest.approx(s / 1.0, rel=1e-3)


def test_upsetting_without_friction_follows_the_closed_form():
    """Plane strain: stress 2 / sqrt(3) (sy + 2 / sqrt(3) H ln(h0 / h)), by platen and by drive."""
    metal, (body, held) = Metal(200e3, 0.3, 1.0, 500.0, 300.0), block(state="plane strain")
    course = pressed(body, held, metal)
    heights = course.x[:, :, 1].max(axis=1)
    stress = PLANE * (500 + 300 * PLANE * np.log(1 / heights[1:]))
    width = course.x[1:, :, 0].max(axis=1)
    assert_allclose(-course.tool_forces[1:, 0, 1] / width, stress, rtol=2.5e-3)
    top = dofs(body.points[:, 1] > 1 - 1e-9, (1,))
    drive = Actions(held, drives=[Drive(top, ((0, 1), (0, -0.3)))])
    driven = sheets.quasi_static(body, metal, drive, np.linspace(0, 1, 31))
    reactions = driven.reactions.reshape(31, -1)[:, top].sum(axis=1)
    assert_allclose(reactions, course.tool_forces[:, 0, 1], rtol=2e-4, atol=1e-9)
    assert np.all(np.diff(course.plastic, axis=0) >= 0)


@pytest.mark.parametrize(("n", "steps"), [(4, 100), (10, 9), (10, 25)])
def test_upsetting_by_two_thirds_follows_the_closed_form(n, steps):
    metal, (body, held) = Metal(200e3, 0.3, 1.0, 500.0, 300.0), block((n, n), state="plane strain")
    course = pressed(body, held, metal, share=0.66, steps=steps)
    late = course.x[3:]  # what was elastic is no part of the formula
    heights, width = late[:, :, 1].max(axis=1), late[:, :, 0].max(axis=1)
    stress = PLANE * (500 + 300 * PLANE * np.log(1 / heights))
    assert heights[-1] == pytest.approx(0.34, abs=1e-3)
    assert_allclose(-course.tool_forces[3:, 0, 1] / width, stress, rtol=1.5e-3)


@pytest.mark.parametrize(("n", "share"), [((10, 10), 0.7), ((20, 5), 0.66), ((8, 8), 0.72)])
def test_a_block_that_is_pressed_too_flat_is_doubted(n, share):
    """Squares lean over: the force falls below the closed form, and the balance cannot see it."""
    metal, (body, held) = Metal(200e3, 0.3, 1.0, 500.0, 300.0), block(n, state="plane strain")
    with pytest.warns(RomWarning, match=r"from .* s on triangle \d+ is stretched 1\d") as told:
        course = pressed(body, held, metal, share=share, steps=40)
    assert len(told) == 1
    x = course.x[-1]
    height, width = x[:, 1].max(), x[:, 0].max()
    stress = PLANE * (500 + 300 * PLANE * np.log(1 / height))
    assert -course.tool_forces[-1, 0, 1] / width < 0.99 * stress


@pytest.mark.parametrize("at_once", [1, 100, 100_000])
def test_the_doubt_names_the_first_instant_and_its_worst_triangle(monkeypatch, at_once):
    monkeypatch.setattr("rom.components.assumed_strain.implicit.TRIANGLES_AT_ONCE", at_once)
    (body, held), rng, kept = block((4, 4)), np.random.default_rng(5), []
    for k, height in enumerate((1.0, 0.35, 0.18, 0.1, 0.4, 0.5, 1.0)):
        x = body.points @ [[1.0, 0.0], [0.7, height]] + rng.normal(0, 0.006, body.points.shape)
        kept.append(SimpleNamespace(t=0.1 * k, x=x))
    F = [np.einsum("tia,tsib->tsab", now.x[body.patch], body.gradients[:, 0]) for now in kept]
    s = np.linalg.svd(np.reshape(F, (7, len(body.patch), -1, 2)), compute_uv=False)
    worst = s[..., 0] / s[..., 1]
    assert [ratio.max() > 10 for ratio in worst] == [False] * 2 + [True] * 2 + [False] * 3
    named = f"from 0.2 s on triangle {worst[2].argmax()} is stretched {worst[2].max():.3g} times"
    with pytest.warns(RomWarning, match=named) as told:
        _Way(body, SOFT, prepared(body, Actions(held)), None, 0.0).doubt(kept)
    assert len(told) == 1


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.1])
def test_upsetting_of_a_disc_follows_siebels_formula(friction):
    """Mean pressure on a flat cylinder: yield stress (1 + 2 mu R / (3 h)), h the whole height."""
    body, held = block((24, 6), (2.0, 0.5), state="axisymmetric")
    course = pressed(body, held, Metal(200e3, 0.3, 1.0, 500.0, 0.0), friction=friction, share=0.1)
    for k in (10, 20, 30):
        R, h = course.x[k, :, 0].max(), 2 * course.x[k, :, 1].max()
        mean = -course.tool_forces[k, 0, 1] / (np.pi * R**2)
        assert mean == pytest.approx(500 * (1 + 2 * friction * R / (3 * h)), rel=0.012)


def punched(element, n=8):
    """Mean pressure of a rough flat punch, half-width 1, over shear strength, as it sinks in."""
    growing = np.cumsum(1.25 ** np.arange(1, 40)) / n
    x = np.r_[np.linspace(0, 1, n + 1), 1 + growing[growing < 4.5]]
    y = -np.r_[0, growing[growing < 4.5]][::-1]
    X, T = sheets.rectangle((len(x) - 1, len(y) - 1), box((0, 0), (len(x) - 1, len(y) - 1)))
    i, j = np.rint(X).astype(int).T
    X = np.column_stack([x[i], y[j]])
    body = sheet(X, T, element=element, state="plane strain")
    punch = (X[:, 1] > -1e-9) & (X[:, 0] < 1 + 1e-9)
    far = (X[:, 1] < X[:, 1].min() + 1e-9) | (X[:, 0] > X[:, 0].max() - 1e-9)
    held = np.r_[dofs(X[:, 0] < 1e-9, (0,)), dofs(far), dofs(punch, (0,))]
    actions = Actions(held, drives=[Drive(dofs(punch, (1,)), ((0, 1), (0, -0.03)))])
    metal = Metal(3000.0, 0.3, 1.0, np.sqrt(3))
    course = sheets.quasi_static(body, metal, actions, np.linspace(0, 1, 16))
    # a node at the end of the punch stands for half the next division as well
    return -course.reactions[:, punch, 1].sum(axis=1) / (1 + 0.5 / n)


def test_a_punch_finds_prandtls_limit_load_where_ordinary_triangles_lock():
    """Slip lines: the pressure 2 + pi times the shear strength; locked elements go on rising."""
    flow, locked = punched("F1"), punched("CST")
    assert flow[-1] == pytest.approx(2 + np.pi, rel=0.05)
    assert flow[-1] / flow[-4] < 1.01
    assert locked[-1] > 1.2 * (2 + np.pi) and locked[-1] / locked[-4] > 1.02


def test_a_bar_necks_after_consideres_load():
    """Plane strain: the force is greatest where d stress / d strain is the stress."""
    L, sy, H = 3.0, 300.0, 350.0
    X, T = sheets.rectangle((24, 8), box((0, 0), (L, 1)))
    X[:, 1] *= 1 - 0.005 * (1 - X[:, 0] / L)  # thinner by 0.5 % in the middle of the bar
    body = sheet(X, T, element="F1", state="plane strain")
    held = np.r_[dofs(X[:, 0] < 1e-9, (0,)), dofs(X[:, 1] < 1e-9, (1,))]
    end = dofs(X[:, 0] > L - 1e-9, (0,))
    actions = Actions(held, drives=[Drive(end, ((0, 1), (0, 1.5)))])
    metal = Metal(200e3, 0.3, 1.0, sy, H)
    course = sheets.quasi_static(body, metal, actions, np.linspace(0, 1, 51))
    force = course.reactions.reshape(51, -1)[:, end].sum(axis=1)
    strain = 1 - sy / (H * PLANE)
    greatest = PLANE * (sy + H * PLANE * strain) * np.exp(-strain)
    assert 0.994 * greatest < force.max() < greatest  # its thinnest section has 0.995
    assert 1.5 * force.argmax() / 50 / L == pytest.approx(np.exp(strain) - 1, abs=0.04)
    middle, far = (course.x[:, X[:, 0] == x, 1].max(axis=1) for x in (0.0, L))
    assert middle[force.argmax()] / far[force.argmax()] > 0.97
    assert middle[-1] / far[-1] < 0.85 and force[-1] < 0.98 * force.max()


def test_a_tool_that_drags_gives_coulombs_force():
    """A block pressed down and then dragged: it sticks, then slides with mu times the pressure."""
    X, T = sheets.rectangle((4, 4), box((0, 0), (1, 1)))
    body = sheet(X, T, state="plane strain")
    way = ((0, 1, 2), ((0, 0), (0, -0.01), (0.05, -0.01)))
    tool = Tool("pad", box((-1, 1), (2, 2)), 0.2, way)
    actions = Actions(dofs(X[:, 1] < 1e-9), tools=[tool])
    course = sheets.quasi_static(body, Metal(100.0, 0.0), actions, np.linspace(0, 2, 41))
    along, across = course.tool_forces[:, 0].T
    assert across[-1] < 0 < along[-1]
    assert along[-1] == pytest.approx(-0.2 * across[-1], rel=1e-6)
    assert np.all(along <= 0.2 * -across + 1e-9)
    assert_allclose(course.reactions.sum(axis=1), -course.tool_forces[:, 0], atol=1e-8)
    rough = Actions(dofs(X[:, 1] < 1e-9), tools=[Tool("pad", tool.outline, np.inf, way)])
    held = sheets.quasi_static(body, Metal(100.0, 0.0), rough, np.linspace(0, 2, 41))
    assert held.tool_forces[-1, 0, 0] > 3 * along[-1]


TILTED = prepared(SMALL, Actions(tools=[Tool("tilted", FAR)])).faces_of(0)


@pytest.mark.parametrize("friction", [0.0, 0.3, np.inf])
def test_the_stiffness_of_a_tool_is_the_derivative_of_its_forces(friction):
    x = np.array([[6.0, 5.3], [7.0, 5.55], [8.0, 5.8], [7.0, 5.2]])
    moved, slip = np.array([[0.5, 0.1], [-0.5, 0.0], [1e-4, 0.0], [0.1, 0.0]]), np.zeros(4)
    stiff = np.array([2.0, 3.0, 4.0, 5.0])

    def forces(step):
        return touch(x + step, moved + step, slip, TILTED, friction, stiff)

    nodes, A = forces(0.0 * x).entries
    assert nodes.tolist() == [0, 1, 2] and not forces(0.0 * x).forces[3].any()
    for axis in range(2):
        step = 1e-7 * np.eye(2)[axis]
        change = (forces(step).forces - forces(-step).forces) / 2e-7
        assert_allclose(-A[:, :, axis], change[:3], atol=1e-6)


def test_a_node_that_holds_remembers_how_far_it_was_dragged():
    """Two small steps along a face give the force of one of both; sliding forgets the excess."""
    step = 0.002 * TILTED[:1, 2:4]

    def dragged(step, slip):
        return touch(np.array([[7.0, 5.55]]), step, slip, TILTED, 0.3, np.array([3.0]))

    one = dragged(step, np.zeros(1))
    two = dragged(step, one.slip)
    assert_allclose(two.forces, dragged(2 * step, np.zeros(1)).forces)
    assert np.abs(two.forces - one.forces).max() > 1e-5
    far = dragged(1e3 * step, np.zeros(1))
    along, across = far.forces[0] @ TILTED[0, 2:4], far.forces[0] @ TILTED[0, 4:6]
    assert along == pytest.approx(-0.3 * across) and across > 0
    assert_allclose(dragged(0 * step, far.slip).forces, far.forces)


BAR = Metal(100.0, 0.0, 1.0)  # waves of 10 m/s


@pytest.mark.parametrize("way", ["explicit", "implicit"])
def test_an_elastic_bar_against_a_wall_leaves_it_as_fast(way):
    """The wall feels rho c v A for the time 2 L / c; then the bar flies back."""
    X, T = sheets.rectangle((60, 1), box((0, 0), (1, 0.02)))
    body, v = sheet(X, T, element="F1"), np.zeros_like(X)
    v[:, 0] = -0.01
    actions = Actions(dofs(X[:, 0] >= 0, (1,)), tools=[Tool("wall", box((-1, -1), (0, 1)))])
    if way == "explicit":
        run = sheets.fly(body, BAR, v, (), 0.3, pictures=301, actions=actions)
    else:
        run = sheets.implicit_motion(body, BAR, actions, np.linspace(0, 0.3, 301), v=v)
    force, t = run.tool_forces[:, 0, 0], run.t
    during = (t > 0.03) & (t < 0.17)
    assert force[during].mean() == pytest.approx(1.0 * 10 * 0.01 * 0.02, rel=0.02)
    assert np.all(force[t > 0.22] == 0)
    impulse = (force[1:] * np.diff(t)).sum()
    assert impulse == pytest.approx(2 * 0.01 * 0.02, rel=0.04)
    back = (run.x[-1] - run.x[-31]).mean() * 2 / (run.t[-1] - run.t[-31])
    assert back == pytest.approx(0.01, rel=0.05)  # a bar that gained energy would be faster
    assert back < 0.01001


def test_implicit_motion_has_the_period_and_order_of_its_source():
    """A bar rings with 4 L / c; errors of generalized-alpha fall with the square of the step."""
    X, T = sheets.rectangle((40, 1), box((0, 0), (1, 0.02)))
    body, v = sheet(X, T, element="F1"), np.zeros_like(X)
    v[:, 0] = 1e-4 * np.sin(np.pi * X[:, 0] / 2)
    actions = Actions(np.union1d(dofs(X[:, 0] < 1e-9), dofs(X[:, 0] >= 0, (1,))))
    errors = []
    for n in (20, 40, 80):
        times = np.linspace(0, 0.4, n + 1)
        run = sheets.implicit_motion(body, BAR, actions, times, v=v, rho_inf=1.0)
        end = run.x[:, X[:, 0].argmax(), 0] - 1
        exact = 1e-4 * np.sin(2 * np.pi * run.t / 0.4) * 0.4 / (2 * np.pi)
        errors.append(np.abs(end - exact).max())
    assert errors[2] < 3e-8 and 3.3 < errors[0] / errors[1] < 4.5
    start, last = (0.5 * u.ravel() @ (sheets.mass(body, BAR) @ u.ravel()) for u in (v, run.v[-1]))
    assert last == pytest.approx(start, rel=1e-4)  # a whole period; rho_inf = 1 keeps the energy


def test_a_suddenly_loaded_bar_swings_to_twice_its_rest_and_supports_carry_it():
    X, T = sheets.rectangle((20, 1), box((0, 0), (1, 0.02)))
    body, f = sheet(X, T, element="F1"), np.zeros_like(X)
    f[X[:, 0] > 1 - 1e-9, 0] = 5e-6
    actions = Actions(np.union1d(dofs(X[:, 0] < 1e-9), dofs(X[:, 0] >= 0, (1,))), loads=[Load(f)])
    run = sheets.implicit_motion(body, BAR, actions, np.linspace(0, 0.4, 161), rho_inf=0.9)
    rest = f.sum() / (100 * 0.02)
    end = run.x[:, X[:, 0].argmax(), 0] - 1
    assert end.max() == pytest.approx(2 * rest, rel=0.02)
    assert run.t[end.argmax()] == pytest.approx(0.2, abs=0.006)
    explicit = sheets.fly(body, BAR, 0 * X, (), 0.4, pictures=161, actions=actions)
    assert_allclose(explicit.x[:, -1, 0] - 1, end, atol=0.08 * rest)  # both smear the front
    wall, there = run.reactions[:, X[:, 0] < 1e-9, 0].sum(axis=1), (run.t > 0.11) & (run.t < 0.29)
    assert wall[there].mean() == pytest.approx(-2 * f.sum(), rel=0.03)  # the front came back


def test_driven_nodes_move_as_told_in_both_ways():
    X, T = sheets.rectangle((10, 1), box((0, 0), (1, 0.1)))
    body, times = sheet(X, T, element="F1"), np.linspace(0, 4.0, 401)
    root = dofs(X[:, 0] < 1e-9, (0,))
    drive = Drive(root, (times, 1e-3 * (1 - np.cos(np.pi * times / 2)) / 2))
    actions = Actions(dofs(X[:, 0] >= 0, (1,)), drives=[drive])
    one = sheets.implicit_motion(body, BAR, actions, times)
    two = sheets.fly(body, BAR, 0 * X, (), 4.0, pictures=5, actions=actions)
    for run, k in ((one, 200), (two, 2)):
        assert_allclose(run.x[k, :, 0] - X[:, 0], 1e-3, rtol=0.03)
        assert run.x[k, 0, 0] == pytest.approx(1e-3, rel=2e-3)


@pytest.mark.parametrize("way", ["explicit", "implicit"])
@pytest.mark.parametrize("driven", ["root", "all"])
def test_what_drives_a_mass_gives_it_its_acceleration(way, driven):
    """x = c t^3 from the start: the drive gives the mass times 6 c t, own nodes included."""
    X, T = sheets.rectangle((10, 2), box((0, 0), (1, 0.2)))
    body, times, c = sheet(X, T, element="F1", thickness=0.5), np.linspace(0, 4.0, 401), 1e-4
    moved = dofs(X[:, 0] < (1e-9 if driven == "root" else 2.0), (0,))
    drive = Drive(moved, (times, c * times**3))
    actions = Actions(dofs(X[:, 0] >= 0, (1,)), drives=[drive])
    if way == "implicit":
        run = sheets.implicit_motion(body, BAR, actions, times)
    else:  # histories are straight between corners, as long as its steps
        h = np.linspace(0, 5.0, 50001)
        actions = Actions(actions.held, drives=[Drive(moved, (h, c * h**3))])
        run = sheets.fly(body, BAR, 0 * X, (), 4.0, pictures=101, actions=actions)
    late = run.t > 2.0
    given = run.reactions.reshape(len(run.t), -1)[:, moved].sum(axis=1)[late]
    assert_allclose(given.mean(), (1.0 * 0.2 * 0.5 * 6 * c * run.t[late]).mean(), rtol=0.01)


def test_a_belt_takes_a_block_along_until_both_are_as_fast():
    """Explicit; v = mu p A t / m up to the speed of the belt, a tool that moves sideways."""
    X, T = sheets.rectangle((3, 3), box((0, 0), (1, 1)))
    body, p, mu, fast = sheet(X, T, element="F1", thickness=0.5), 0.2, 0.3, 0.05
    sides = sheets.outer_sides(body)
    top = sides[(X[sides][:, :, 1] > 1 - 1e-9).all(axis=1)]
    load = Traction(top, pressure=p, history=((0, 2), (0, 1)))
    for turned in (1, -1):
        way = ((0, 8), ((0, 0), (turned * 8 * fast, 0)))
        belt = Tool("belt", box((-9, -1), (9, 0)), mu, way)
        acts = Actions(tools=[belt], tractions=[load])
        run = sheets.fly(body, Metal(400.0, 0.0, 1.0), 0 * X, (), 2.5, pictures=251, actions=acts)
        x, t = run.x[:, :, 0].mean(axis=1) - 0.5, run.t
        # the pressure grows as t / 2, and so does friction: v = mu p t^2 / 4 until it is fast
        end = np.sqrt(4 * fast / (mu * p))
        exact = np.where(t < end, mu * p * t**3 / 12, mu * p * end**3 / 12 + fast * (t - end))
        assert end < 2.0
        assert_allclose(turned * x, exact, atol=0.03 * exact[-1])
        impulse = (run.tool_forces[1:, 0, 0] * np.diff(t)).sum()
        assert impulse == pytest.approx(turned * 0.5 * fast, rel=0.03)


def test_taylors_bar_against_a_tool_is_that_of_held_nodes():
    R, L = 3.2e-3, 32.4e-3
    copper = Metal(117e9, 0.35, 8930.0, yield_stress=400e6, hardening=100e6)
    X, T = sheets.rectangle((5, 50), box((0, 0), (R, L)))
    body, v = sheet(X, T, element="F1", state="axisymmetric"), np.zeros_like(X)
    v[:, 1] = -227.0
    feet = {}
    for friction in (0.0, np.inf):
        wall = Tool("wall", box((-0.01, -0.01), (0.05, 0)), friction)
        acts, axis = Actions(tools=[wall]), dofs(X[:, 0] < 1e-9, (0,))
        run = sheets.fly(body, copper, v, axis, 80e-6, actions=acts)
        feet[friction] = 1e3 * run.x[-1, :, 0].max(), 1e3 * run.x[-1, :, 1].max()
        impulse = (run.tool_forces[1:, 0, 1] * np.diff(run.t)).sum()
        assert impulse == pytest.approx(sheets.mass(body, copper).sum() / 2 * 227, rel=0.03)
        assert run.x[..., 1].min() > -1e-9
    assert_allclose(feet[0.0], [6.9, 21.45], rtol=0.02)
    assert feet[np.inf][0] < 0.9 * feet[0.0][0]


@pytest.mark.parametrize("way", ["quasi_static", "implicit", "explicit"])
def test_a_history_is_a_number_a_function_a_table_or_a_pair(way):
    f, times = 0.01 * np.ones_like(SMALL.points), np.linspace(0, 1, 5)
    fine = np.linspace(0, 1, 2001)
    wave, found = sine(1.0, 0.7), []
    far = Tool("far", FAR, 0.0, lambda t: np.outer(t, [1, 0]))
    for history in (wave, Table(fine, wave(fine)), (fine, wave(fine)), lambda t: 0 * t, 0.0):
        actions = Actions(range(6), loads=[Load(f, history)], tools=[far])
        if way == "quasi_static":
            found.append(sheets.quasi_static(SMALL, SOFT, actions, times).x)
        elif way == "implicit":
            found.append(sheets.implicit_motion(SMALL, SOFT, actions, times).x)
        else:
            found.append(sheets.fly(SMALL, SOFT, 0 * f, (), 1.0, pictures=5, actions=actions).x)
    assert np.abs(found[0] - SMALL.points).max() > 1e-4
    assert_allclose(found[1], found[0], atol=1e-7)
    assert_allclose(found[2], found[1], atol=1e-14)
    assert_allclose(found[3], np.tile(SMALL.points, (5, 1, 1)), atol=1e-12)
    assert_allclose(found[4], found[3], atol=1e-14)


ABOVE = box((-1, 1), (2, 2))


@pytest.mark.parametrize(
    ("actions", "error", "words"),
    [
        ({"tools": [Tool("punch", box((0.2, 0.9), (0.8, 2)))]}, MeshError,
         "tool 'punch' starts 0.1 m inside the sheet at node 7"),
        ({"tools": [Tool("wedge", [(0.6, 0.8), (0.9, 2), (0.6, 2)])]}, MeshError,
         "corner 0 of tool 'wedge' starts inside the sheet"),
        ({"tools": [Tool("pad", ABOVE[::-1])]}, ConfigError, "'pad': .* not convex, or clockwise"),
        ({"tools": [Tool("pad", ABOVE, -0.1)]}, ConfigError, "'pad': friction = -0.1"),
        ({"tools": [Tool("pad", ABOVE[:2])]}, ConfigError, "'pad': corners of the outline = 2"),
        ({"tools": [Tool("pad", [*ABOVE, ABOVE[-1]])]}, ConfigError, "use it once"),
        ({"tools": [Tool("pad", ABOVE, 0.0, ((0, 1), (0, 1)))]}, ConfigError, r"'pad'.*\(2,\)"),
        ({"loads": [Load(np.zeros((3, 2)))]}, ConfigError, "forces of load 0 has shape"),
        ({"loads": [Load(0 * SMALL.points, ((0, 0), (0, 1)))]}, ConfigError, "load 0: times"),
        ({"drives": [Drive([18], ((0,), (0,)))]}, ConfigError, "drive 0: dofs .* 18 must be"),
        ({"drives": [Drive([3], ((0,), (0,))), Drive([3], ((0,), (1,)))]}, ConfigError, "twice"),
        ({"drives": [Drive([3], ((0,), (np.nan,)))]}, ConfigError, "drive 0: value 0 is .nan"),
        ({"loads": [Load(0 * SMALL.points, None)]}, ConfigError, "load 0: its history must be"),
        ({"loads": [Load(0 * SMALL.points, Table((0, 0.5), (0, 1)))]}, ConfigError, "0.5 s; asked"),
        ({"tools": [Tool("pad", ABOVE, 0.0, np.sin)]}, ConfigError, r"'pad': .*\(257,\), needed"),
        ({"tractions": [Traction([(0, 4)], 1.0)]}, ConfigError, "the side 0-4 is not an outer"),
        ({"tractions": [Traction([(1, 0)], 1.0)]}, ConfigError, "solid on the left"),
        ({"tractions": [Traction([(0, 1)], np.inf)]}, ConfigError, "traction 0: pressure = inf"),
    ],
)  # fmt: skip
def test_actions_that_do_not_fit_are_named(actions, error, words):
    refuses(error, words, lambda: prepared(SMALL, Actions(**actions)))


def test_wrong_runs_are_named():
    refuses(ConfigError, "times = .* 2 or more", sheets.quasi_static, SMALL, SOFT, Actions(), [0.0])
    pad = Actions(tools=[Tool("pad", ABOVE)])
    refuses(ConfigError, "impacts", sheets.implicit_motion, SMALL, SOFT, pad, [0, 1], rho_inf=0.8)
    tear = Actions(range(6), drives=[Drive(range(6, 18), ((0, 1), (0, 30.0)))])
    words, soft = r"grows by 0.\d+, more than 0.05 a step", replace(SOFT, yield_stress=1e-3)
    refuses(SolverError, words, sheets.quasi_static, SMALL, soft, tear, [0, 1])
    crush = Actions(range(6), tools=[Tool("p", ABOVE, 0.0, ((0, 1), ((0, 0), (0, -1.5))))])
    with pytest.raises(SolverError, match="no balance of forces between") as caught:
        sheets.quasi_static(SMALL, SOFT, crush, np.linspace(0, 1, 4))
    assert 1 <= len(caught.value.solution.t) < 4
    assert np.isfinite(sheets.tangent(SMALL, SOFT, caught.value.solution.x[-1]).data).all()


def test_a_disc_touches_where_it_is_round():
    corners = sheets.disc((1.0, 2.0), 0.5, n=40)
    assert_allclose(np.linalg.norm(corners - [1, 2], axis=1), 0.5)
    prepared(sheet(*distorted()), Actions(tools=[Tool("roll", sheets.disc((0.5, 1.5), 0.5, n=40))]))
