"""One motion in any frame, with geometric stiffness and without, answers in the frame chosen."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigvalsh

import rom
from cases.beam import stiffened_beam
from cases.mbs.mechanisms import prepared, random_pose, residual_at
from rom import rotation
from rom.model import OWN_FRAME

FRAMES = ["root", "tip", ("root", "tip"), ("tip", "root"), "mean-axis", "buckens"]


def hinged(frame, gravity=(0.0, -9.81, 0.0)):
    """A beam of 1 m and 1 kg that falls about its root and bends by 2 % of its length."""
    beam = stiffened_beam(EI=70.0, n_modes=12).with_reference(frame)
    mech = rom.Mechanism(gravity=gravity)
    bar = mech.add_flexible("beam", beam)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=(0, 0, 1))
    return mech


def test_the_path_is_the_same_in_any_frame():
    runs = {frame: rom.simulate(hinged(frame), t_end=0.5, dt=1e-3) for frame in FRAMES}
    paths = {frame: sol.position("beam", "tip") for frame, sol in runs.items()}
    for frame in FRAMES[1:]:
        assert_allclose(paths[frame], paths["root"], atol=1e-8, err_msg=f"{frame}")
    assert paths["root"][-1, 1] < -0.9


@pytest.mark.parametrize("deflection", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("frame", FRAMES)
def test_the_mass_matrix_is_definite(frame, deflection):
    mech = hinged(frame)
    beam = mech.part("beam").flexible
    push = beam.marker("tip").translation[1] - beam.marker("root").translation[1]
    push -= beam.marker("root").rotation[2]
    q = np.linalg.solve(beam.K, push)
    packed, W = prepared(mech)
    x = packed.q.copy()
    x[7:] = q * deflection / (push @ q)
    n, free = packed.v.size, np.zeros(packed.system.rows.kind.size)
    columns = []
    for a in [np.zeros(n), *np.eye(n)]:
        W.residual[:] = 0.0
        residual_at(packed.system, W, x, np.zeros(n), a, free)
        columns.append(W.residual.copy())
    M = np.array(columns[1:]) - columns[0]
    assert_allclose(M, M.T, atol=1e-11)
    size = 1 / np.sqrt(np.diag(M))
    assert eigvalsh(M * size * size[:, None])[0] > 1e-6


def test_the_frame_is_that_of_the_interface():
    sol = rom.simulate(hinged("tip"), t_end=0.01, dt=2e-5)
    assert_allclose(sol.position("beam") + sol.axes("beam", "tip")[:, :, 0],
                    sol.position("beam", "tip"), atol=1e-8)  # fmt: skip
    axes = np.array([rotation.matrix(p) for p in sol.orientation("beam")])
    assert_allclose(axes, sol.axes("beam", "tip"), atol=1e-9)
    speed = np.gradient(np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0])), sol.t)
    assert_allclose(sol.omega("beam")[5:-5, 2], speed[5:-5], atol=2e-3)
    rate = np.gradient(sol.position("beam"), sol.t, axis=0)
    assert_allclose(sol.velocity("beam")[5:-5], rate[5:-5], atol=2e-3)


@pytest.mark.parametrize("stiffened", [True, False])
@pytest.mark.parametrize("frame", FRAMES)
def test_a_motion_begins_where_the_frame_was_put(frame, stiffened):
    rng = np.random.default_rng(4)
    pose = random_pose(rng)
    beam = stiffened_beam(n_modes=4, stiffened=stiffened).with_reference(frame)
    q, qd = 0.05 * rng.normal(size=(2, beam.n_modes))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("beam", beam, q=q, qd=qd, **pose)
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-3)
    at_start = rom.mbs.Instant(mech, sol.packed).set(0.0, sol.q[0], sol.v[0])
    for seen in (
        [x[0] for x in (sol.position("beam"), sol.velocity("beam"), sol.omega("beam"))],
        [at_start.position("beam"), at_start.velocity("beam"), at_start.omega("beam")],
    ):
        for found, given in zip(seen, ("at", "velocity", "omega"), strict=True):
            assert_allclose(found, pose[given], atol=1e-12)
    for p in (sol.orientation("beam")[0], at_start.orientation("beam")):
        assert_allclose(rotation.matrix(p), rotation.matrix(pose["orientation"]), atol=1e-12)
    assert_allclose(sol.elastic("beam")[0], q, atol=0)


@pytest.mark.parametrize("stiffened", [True, False])
@pytest.mark.parametrize("frame", FRAMES)
def test_a_free_body_keeps_its_momentum(frame, stiffened):
    beam = stiffened_beam(EI=70.0, n_modes=6, stiffened=stiffened).with_reference(frame)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("beam", beam, omega=(0, 0, 3.0), q=2e-3 * np.eye(6)[0])
    linear, angular = rom.simulate(mech, t_end=0.1, dt=1e-4).momentum
    assert np.ptp(linear, axis=0).max() < 1e-4 * np.abs(angular[0]).max()
    assert np.ptp(angular, axis=0).max() < 1e-4 * np.abs(angular[0]).max()


@pytest.mark.parametrize("frame", FRAMES)
def test_a_spread_load_bends_a_cantilever_as_its_closed_form(frame):
    """p L^4 / 8 EI, however its frame moves."""
    beam = stiffened_beam(n_modes=12).with_reference(frame)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("beam", beam)
    mech.fixed("clamp", mech.ground.marker((0, 0, 0)), bar.marker("root"))
    mech.spread_load("load", bar, rom.mass_load(beam, (0, -1e-3, 0)), frame="world")
    deflection = rom.snapshot(mech, rom.equilibrium(mech)).position("beam", "tip").ravel()[1]
    assert_allclose(deflection, -1e-3 / 8, rtol=1e-4)


@pytest.mark.parametrize("stiffened", [True, False])
def test_equal_bodies_are_moved_once(stiffened):
    beam = stiffened_beam(n_modes=3, stiffened=stiffened)
    mech = rom.Mechanism()
    one, two = (mech.add_flexible(name, beam) for name in "ab")
    assert one.moving is two.moving is not beam
    free = beam.with_reference("free")
    assert mech.add_flexible("c", free).moving is free


def test_an_interface_has_another_name_than_the_frame():
    beam = stiffened_beam(n_modes=3)
    root = replace(beam.marker("root"), name=OWN_FRAME)
    named = replace(beam, markers=beam.markers | {OWN_FRAME: root})
    with pytest.raises(rom.ConfigError, match=f"an interface '{OWN_FRAME}'.*another name"):
        rom.Mechanism().add_flexible("beam", named)
