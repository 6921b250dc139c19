"""Data for MBDyn: read as its program reads them, its equations give the motion of particles."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.files.mbdyn import groups, numbers
from cases.mbs.mechanisms import nodal_body, random_body, random_nodes
from cases.mbs.particles import motion, particles
from rom.errors import ConfigError


def equations(found, q, qd, qdd, a, omega, domega):
    """Force, moment and elastic rows as the joint assembles them from the invariants."""
    r, cross = q.size, np.cross
    inv3, inv4 = (numbers(found[k], 3, r) for k in (14, 15))
    inv8 = numbers(found[16], 3, r, 3).transpose(1, 0, 2)  # by mode
    inv5 = numbers(found[17], 3, r, r).transpose(1, 0, 2)  # [j][:, k]
    inv9 = numbers(found[18], 3, r, r, 3).transpose(1, 2, 0, 3)
    mass, centre, about = float(found[12][0]), *np.split(numbers(found[12][1:], 4, 3), [1])
    centre = centre[0]
    J = about + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    i8, i8d = np.tensordot(q, inv8, 1), np.tensordot(qd, inv8, 1)
    i9 = np.einsum("j,k,jkab->ab", q, q, inv9)
    i9d = np.einsum("j,k,jkab->ab", q, qd, inv9)
    i5, i5d = np.tensordot(q, inv5, 1), np.tensordot(qd, inv5, 1)
    J = J + i8 + i8.T - i9
    S = mass * centre + inv3 @ q
    force = mass * a - cross(S, domega) + cross(omega, cross(omega, S))
    force = force + inv3 @ qdd + 2 * cross(omega, inv3 @ qd)
    moment = cross(S, a) + J @ domega + cross(omega, J @ omega) + inv4 @ qdd + i5 @ qdd
    moment = moment + 2 * (i8d - i9d) @ omega
    M, K, D = (numbers(found[k], r, r) for k in (9, 10, 13))
    elastic = M @ qdd + D @ qd + K @ q + inv3.T @ a + (inv4 + i5).T @ domega + 2 * i5d.T @ omega
    for j in range(r):
        A = inv8[j].T - np.tensordot(q, inv9[j], 1)
        elastic[j] -= omega @ A @ omega
    return force, moment, elastic


def test_the_joint_moves_like_particles_to_second_order(tmp_path):
    """All three rows, for deformations of any size."""
    nodes = random_nodes(np.random.default_rng(5), n=7, r=4)
    x, _, phi, _, _ = nodes
    body = nodal_body(*nodes, {"a": (x[0], phi[:, 0].T, np.zeros((3, 4)))})
    found = groups(rom.export(body, tmp_path / "b.fem"))
    for got, expected in zip(equations(found, *motion()), particles(nodes, *motion()), strict=True):
        assert_allclose(got, expected, atol=1e-11 * np.abs(expected).max())


def test_nodes_are_the_interfaces(tmp_path):
    body = random_body(np.random.default_rng(1))
    found = groups(rom.export(body, tmp_path / "b.fem"))
    assert found[1] == ["REV0", "2", "4", "0", "0", "0"]
    assert found[2] == ["a", "b"]
    points = np.array([numbers(found[k], 2) for k in (5, 6, 7)]).T
    assert_array_equal(points, [m.point for m in body.markers.values()])
    shapes = numbers(found[8], 4, 2, 6)
    for k, m in enumerate(body.markers.values()):
        assert_array_equal(shapes[:, k, :3].T, m.translation)
        assert_array_equal(shapes[:, k, 3:].T, m.rotation)
    assert 19 not in found and (tmp_path / "b.fem").read_text().count("NORMAL MODE SHAPE") == 4


def test_stiffening_stands_at_the_numbers_of_its_loads(tmp_path):
    body = random_body(np.random.default_rng(2), stiffened=True)
    words = groups(rom.export(body, tmp_path / "b.fem"))[19]
    assert int(words[0]) == 24
    table = numbers(words[1:], 24, 17)
    K = {int(row[0]): row[1:].reshape(4, 4) for row in table}
    for number, load in {
        1: "omega_x^2", 3: "omega_z^2", 4: "omega_x omega_y", 5: "omega_y omega_z",
        6: "omega_x omega_z", 7: "domega_x", 12: "a_z", 13: "a f_x", 16: "a m_x", 24: "b m_z",
    }.items():  # fmt: skip
        assert_array_equal(K[number], body.K_geo[load])


def test_what_mbdyn_cannot_take_is_named(tmp_path):
    body = random_body(np.random.default_rng(2))
    a, b = body.markers.values()
    with pytest.raises(ConfigError, match="4 shapes and 0 interfaces"):
        rom.export(replace(body, markers={}), tmp_path / "b.fem")
    with pytest.raises(ConfigError, match=r"differ in more than blanks, got \['a_b', 'a_b'\]"):
        rom.export(replace(body, markers={"a b": a, "a_b": b}), tmp_path / "b.fem")
