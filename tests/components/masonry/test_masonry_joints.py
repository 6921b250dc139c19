"""Joints with strength, and its loss; an arch whose supports spread until it falls."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from cases.components.masonry import SOFT, G, box
from cases.refusals import refuses
from rom.components import masonry
from rom.components.masonry import Joint, Masonry, PointLoad, arch, simulate, stands, stone
from rom.components.masonry.block_contact import contacts, drop_doubles
from rom.errors import ConfigError, FileFormatError


def pair(joint, *, below=False, **options):
    """A held stone, and a free one on it or hanging below it; joints softer than stone."""
    free = box(at=(0.0, -1.0 if below else 1.0))
    stones = (stone(box(7.0, at=(-1.0, 0.0)), **SOFT), stone(free, **SOFT))
    return Masonry(stones, (0,), 0.1 * SOFT["E"], 0.9, joints=(joint,), **options)


def pulled(model, force, at):
    load = PointLoad(1, at, force, masonry.ramp(0.5))
    return simulate(model, t_end=2.0, dt=5e-3, actions=[load], damping=6.0, save_every=10)


@pytest.mark.parametrize(("factor", "holds"), [(0.98, True), (1.02, False)])
def test_a_stone_hangs_until_tension_is_reached(factor, holds):
    """Weight 2000 g of a stone of 1 m2; a pull in the middle adds what is missing."""
    model, pull = pair(Joint(0.6, 1e5, 5e4), below=True), (0.0, 2000 * G - factor * 5e4)
    motion = pulled(model, pull, (0.5, -1.0))
    assert bool(abs(motion.v[-1, 1, 1]) < 1e-6) is holds
    assert (motion.broken[-1] == 0) is np.bool_(holds)
    assert stands(model, [PointLoad(1, (0.5, -1.0), pull)]) is holds
    if holds:
        ((_, force),) = motion.joints().values()
        assert_allclose(np.abs(force), [0, factor * 5e4], atol=10.0)


@pytest.mark.parametrize(("thickness", "holds"), [(1.0, False), (2.0, True)])
def test_a_joint_twice_as_thick_holds_twice_as_much(thickness, holds):
    model = pair(Joint(0.6, 1e5, 1.5e4), below=True, thickness=thickness)
    assert (simulate(model, t_end=1.0, dt=5e-3).broken[-1] == 0) is np.bool_(holds)


@pytest.mark.parametrize(("factor", "holds"), [(0.98, True), (1.02, False)])
def test_a_stone_slips_at_cohesion_and_friction(factor, holds):
    """Coulomb: c L + mu W, pushed at the foot so that the joint stays closed."""
    c, mu = 3e4, 0.6
    model = pair(Joint(mu, c, 1e6))
    limit = c * 1.0 + mu * 2000 * G
    motion = pulled(model, (factor * limit, 0.0), (0.0, 1.0))
    assert bool(np.abs(motion.v[-1, 1, 0]) < 1e-6) is holds


def test_cohesion_lost_leaves_friction():
    """After a blow that breaks the joint, half of what it bore moves it: a = F / m - mu g."""
    c, mu = 3e4, 0.5
    first, then = 1.1 * (c + mu * 2000 * G), 0.5 * (c + mu * 2000 * G)
    history = masonry.Table([0.0, 0.1, 0.2, 0.3, 5.0], [0.0, first, first, then, then])
    load = [PointLoad(1, (0.0, 1.5), (1.0, 0.0), history)]
    motion = simulate(pair(Joint(mu, c, 1e6)), t_end=0.5, dt=1e-3, actions=load)
    a = (motion.v[-1, 1, 0] - motion.v[-100, 1, 0]) / (motion.t[-1] - motion.t[-100])
    assert motion.broken[-1] == 2  # both corners of the stone
    assert a == pytest.approx(then / 2000 - mu * G, rel=0.02)
    unbroken = masonry.Table([0.0, 0.3, 5.0], [0.0, then, then])
    load = [PointLoad(1, (0.0, 1.5), (1.0, 0.0), unbroken)]
    still = simulate(pair(Joint(mu, c, 1e6)), t_end=0.5, dt=1e-3, actions=load)
    assert still.broken[-1] == 0 and abs(still.q[-1, 1, 0] - still.q[0, 1, 0]) < 1e-3


@njit
def drop(C, P):
    drop_doubles(C, P, 0.05)


def test_of_two_corners_that_meet_the_glued_one_parts_the_stones():
    """By gap alone the other, which bears no tension, would; without glue it does."""
    for bond, left in ((0, [1]), (-1, [3])):
        C = contacts(2, 3, 2)
        C.used[0], C.first[:] = 2, ([1, 1, 2] if bond == 0 else [0, 1, 2])
        C.who[:] = [0, 1, 1, 4, 5], [1, 3, 0, 2, 3]
        C.bond[:], C.gap[:] = (bond, -1), (-1e-4, 1e-4)
        C.along[:, 1:3] = (0.0, -1.0), (-1.0, 0.0)
        drop(C, np.zeros((8, 2)))
        assert C.who[: C.used[0], 1].tolist() == left
        assert C.first.tolist() == ([1, 1, 1] if bond == 0 else [0, 0, 1])


def test_a_joint_that_opened_does_not_glue_again():
    history = masonry.Table([0.0, 0.2, 0.5, 0.8, 3.0], [0.0, 1.0, 1.0, 0.0, 0.0])
    model = pair(Joint(0.6, 5e4, 3e4))
    pulls = ((0.0, factor * (2000 * G + 3e4)) for factor in (1.02, 0.9))
    up, less = ([PointLoad(1, (0.5, 2.0), pull, history)] for pull in pulls)
    motion = simulate(model, t_end=3.0, dt=2e-3, actions=up, damping=15.0)
    assert motion.broken[-1] > 0 and abs(motion.v[-1, 1, 1]) < 1e-3
    assert motion.q[:, 1, 1].max() > 1.6 and motion.q[-1, 1, 1] == pytest.approx(1.5, abs=1e-3)
    assert simulate(model, t_end=1.0, dt=2e-3, actions=less, damping=15.0).broken[-1] == 0


def test_friction_of_one_joint_is_its_own():
    ground = stone(np.array([[-1, -1], [5, -1], [5, 0], [-1, 0]]), **SOFT)
    stones = (ground, stone(box(), **SOFT), stone(box(at=(3.0, 0.0)), **SOFT))
    joints = (Joint(0.9), Joint(0.2, between=((2, 0),)))
    slope = np.radians(30)
    g = (G * np.sin(slope), -G * np.cos(slope))
    model = Masonry(stones, (0,), 1e10, 0.0, g, joints=joints)
    motion = simulate(model, t_end=0.5, dt=1e-3)
    assert abs(motion.q[-1, 1, 0] - motion.q[0, 1, 0]) < 1e-3
    exact = (np.sin(slope) - 0.2 * np.cos(slope)) * G * 0.5**2 / 2
    assert motion.q[-1, 2, 0] - motion.q[0, 2, 0] == pytest.approx(exact, rel=1e-3)


def test_mortar_holds_up_an_arch_that_is_too_thin():
    thin = arch(10, 5.0, 0.45)
    glued = Masonry(thin.stones, thin.held, thin.stiffness, 0.84, joints=(Joint(0.84, 4e6, 2e6),))
    assert not stands(thin) and stands(glued)
    run = {"t_end": 2.0, "dt": 1e-3, "damping": 30.0, "save_every": 2000}
    bare, held = (simulate(m, **run) for m in (thin, glued))
    assert np.abs(bare.v[-1]).max() > 1e-3
    assert np.abs(held.v[-1]).max() < 1e-6 and held.broken[-1] == 0


def test_joints_come_from_a_file(tmp_path):
    path = tmp_path / "joints.toml"
    path.write_text("""
[[joint]]
friction = 0.6
[[joint]]
between = [[0, 1]]
friction = 0.7
cohesion = "0.2 MPa"
tension = 1e5
""")
    assert masonry.read_joints(path) == (Joint(0.6), Joint(0.7, 2e5, 1e5, ((0, 1),)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[joint]]\nfriction = 0.6\nglue = 1", r"joint 1 has \['friction', 'glue'\]. It needs"),
        ("[[joint]]\ncohesion = 1.0", "It needs friction"),
        ("[[joint]]\nfriction = '0.2 MPa'", "joint 1: "),
        ("[[joint]]\nfriction = true", "True is no number"),
        ("[[joint]]\nfriction = 0.1\nbetween = [[1]]", "joint 1: "),
        ("[[joint]]\nfriction = 0.1\nbetween = [[1, 2.5]]", "2.5: stones go by their numbers"),
        ("[joint]\nfriction = 0.6", "laws of joints are tables"),
        ("friction = 0.6", "laws of joints are tables"),
        ("[[joint", "is no file of joints"),
    ],
)
def test_files_that_are_no_joints_are_named(text, words, tmp_path):
    path = tmp_path / "joints.toml"
    path.write_text(text)
    refuses(FileFormatError, words, masonry.read_joints, path)


def test_joints_that_cannot_be_are_named(tmp_path):
    path = tmp_path / "joints.toml"
    path.write_text("[[joint]]\nfriction = -0.6")
    refuses(ConfigError, r"joint 1: friction = -0.6", masonry.read_joints, path)
    for between in (((0, 5),), ((1, 1),)):
        with pytest.raises(ConfigError, match="use stones from 0 to 1"):
            simulate(pair(Joint(0.5, between=between)), t_end=0.1, dt=0.01)
    apart = Masonry((stone(box(), **SOFT), stone(box(at=(0, 1.5)), **SOFT)), (0,), 1e10, 0.5,
                    joints=(Joint(0.5, 1e5, between=((0, 1),)),))  # fmt: skip
    refuses(ConfigError, "stones 0 and 1 do not touch", simulate, apart, t_end=0.1, dt=0.01)


def spread_arch(n, thickness, k, x):
    """Rigid stones of an arch of radius 1, its supports moved apart by x, hinged at joints k."""
    rock, model = masonry.Rock(friction=2.0), arch(n, 1.0, thickness)
    angle = k * np.pi / n
    hinge = (1 - thickness / 2) * np.array([np.sin(angle), np.cos(angle)])
    arm = np.array([0.0, 1 + thickness / 2]) - hinge
    turn = np.arctan2(arm[1], -arm[0]) - np.arccos((hinge[0] + x / 2) / np.hypot(*arm))
    stones = []
    for b, one in enumerate(model.stones):
        side, below = (-1, n // 2 - b) if b <= n // 2 else (1, b - n // 2 - 1)
        c, s = np.cos(turn), side * np.sin(turn)
        pivot, outline = hinge * (side, 1), one.outline
        if below < k:
            outline = (outline - pivot) @ np.array([[c, s], [-s, c]]) + pivot
        stones.append(rock.stone(outline + np.array([side * x / 2, 0.0])))
    return replace(rock.masonry(stones, model.held), reach=1e-5)


def test_supports_of_an_arch_spread_until_it_falls():
    """Ochsendorf's mechanism (2002) by rigid statics; t / R = 0.2 bears far more than 0.15."""
    for thickness, k in ((0.15, 6), (0.2, 7)):
        low, high = 0.0, 0.5
        while high - low > 1e-4:
            x = (low + high) / 2
            low, high = (x, high) if stands(spread_arch(20, thickness, k, x)) else (low, x)
        model = arch(20, 1.0, thickness, rock=masonry.Rock(friction=2.0))
        for factor, stays in ((0.9, True), (1.15, False)):
            ends = (0, -factor * low / 2), (21, factor * low / 2)
            grow = masonry.ramp(3.0)
            spread = [masonry.SupportMotion((k,), (x, 0.0), 0.0, grow) for k, x in ends]
            run = {"t_end": 4.5, "dt": 2e-3, "damping": 25.0, "save_every": 750}
            motion = simulate(model, actions=spread, **run)
            speed = np.abs(motion.v[-1, 1:-1]).max()
            drop = motion.q[0, 10, 1] - motion.q[-1, 10, 1]
            assert bool(speed < 1e-4 and drop < 0.3) is stays, (thickness, factor, speed, drop)
