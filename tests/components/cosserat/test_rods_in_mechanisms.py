"""Non-linear bodies in a mechanism: rods against their own solvers, and a law of a stranger."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numba import carray, cfunc
from numpy.testing import assert_allclose

import rom
from benchmarks.models import bar
from cases.components.rods import ALONG_X
from cases.mbs.floating_rod import swing
from cases.mbs.tangents import by_position, by_velocity
from cases.refusals import refuses
from cases.solid import reduced
from rom import rotation, view
from rom.components import cosserat
from rom.components.cosserat import body, shape_of
from rom.errors import ConfigError, ModelError
from rom.mbs.elements.nonlinear import Elements, Frames
from rom.mbs.equations.equations import retract
from rom.mbs.equations.packing import pack
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.kernels.work import workspace
from rom.view.scenes.film import shades_of

ORIGIN = (0.0, 0.0, 0.0)
SECTION = {"stretch": (5e5, 5e5, 1e6), "bend": (1e3, 2e3, 1.5e3), "mass": 1.0,
           "inertia": (1e-2, 2e-2, 3e-2)}  # fmt: skip


def a_rod(n=12, **more):
    """A rod along x whose plates have inertia, as its body has."""
    rod = cosserat.straight(10.0, n, frame=ALONG_X, **(SECTION | more))
    return rod._replace(inertia=body(rod).frames.inertia)


def clamped(rod, gravity=ORIGIN):
    mech = rom.Mechanism(gravity=gravity)
    part = mech.add_nonlinear("rod", body(rod))
    mech.fixed("clamp", mech.ground.marker(ORIGIN), part.marker("start"))
    return mech, part


def hinged(rod):
    mech = rom.Mechanism(gravity=ORIGIN)
    part = mech.add_nonlinear("rod", body(rod))
    mech.revolute("clamp", mech.ground.marker(ORIGIN), part.marker("start"), axis=(0, 1, 0))
    free = cosserat.clamped(rod)
    free[0] = True  # the first axis of the section is the second of the world
    return mech, part, free


@pytest.mark.parametrize("how", ["clamped", "hinged"])
def test_a_rod_moves_as_its_own_equations_say(how):
    rod = a_rod(3, viscosity=1e-3, stretch=(5e3, 5e3, 1e4), inertia=(0.1, 0.2, 0.3))
    mech, part, free = hinged(rod) if how == "hinged" else (*clamped(rod), cosserat.clamped(rod))
    mech.force("tip", part.marker("end"), (-5.0, 30.0, 10.0))
    load = cosserat.loads(rod, tip=(-5, 30, 10))
    shape = swing(rod, 0.5, load, free)
    assert np.linalg.norm(shape.x[-1] - rod.x[-1]) > 0.5
    sol = rom.simulate(mech, t_end=0.5, dt=0.05, method="dop853", rtol=1e-9)
    alone = cosserat.simulate(rod, 0.5, 1e-3, load=load, free=free, rho_inf=1.0)
    for found, atol in ((shape_of(sol, "rod"), 1e-7), (alone.shape(-1), 1e-4)):
        assert_allclose(found.x, shape.x, atol=atol)
        assert_allclose(np.abs(np.sum(found.p * shape.p, axis=1)), 1.0, atol=atol)
    own = rom.simulate(mech, t_end=0.5, dt=1e-3, rho_inf=1.0)
    assert_allclose(alone.x[-1], shape_of(own, "rod").x, atol=1e-10)
    assert_allclose(own.energy.kinetic + own.energy.strain, alone.energies().sum(axis=1), atol=1e-6)
    moment = alone.shape(-1).frame(0) @ alone.root[-1, 3:]  # in axes of the world
    assert_allclose(own.reaction("clamp")[-1], [*alone.root[-1, :3], *moment], atol=1e-4)
    assert own.statistics["rank"] == sol.lam.shape[1]
    assert own.packed.by_blocks


def test_statics_and_frequencies_are_those_of_the_rod():
    """Elastica P L^2 / EI = 2: deflection 0.493457 and shortening 0.160642 of the length."""
    n = 80
    rod = cosserat.straight(1.0, n, frame=ALONG_X, stretch=1e6, bend=1.0, mass=1.0,
                            inertia=(1e-4, 1e-4, 2e-4))  # fmt: skip
    rod = rod._replace(inertia=body(rod).frames.inertia)
    mech, part = clamped(rod)
    mech.force("tip", part.marker("end"), (0, 0, 2.0))
    state = rom.equilibrium(mech)
    x = state.q.reshape(-1, 7)[:-1, :3]
    load = cosserat.loads(rod, tip=(0, 0, 2.0))
    shape = cosserat.equilibrium(rod, load)
    assert_allclose(x, shape.x, atol=1e-12)
    assert_allclose([x[-1, 2], 1 - x[-1, 0]], [0.493457, 0.160642], rtol=3e-4)
    theirs = cosserat.modes(rod, shape, 6, load=load).frequencies
    assert_allclose(rom.linearize(mech, state).frequencies[:6], theirs, rtol=1e-7)


def test_tangents_of_a_bent_and_moving_rod():
    """The rate of viscous forces with the position is left out; without it all is exact."""
    rng = np.random.default_rng(5)
    for viscosity in (0.0, 0.02):
        packed = pack(clamped(a_rod(3, viscosity=viscosity))[0], whole=True)
        q = packed.q.copy()
        retract(packed.system, packed.q, 0.3 * rng.normal(size=packed.v.size), q)
        packed.q[:], W = q, workspace(packed.system, 0)
        n, lam = packed.v.size, rng.normal(size=packed.system.rows.kind.size)
        v = rng.normal(size=n) if viscosity else np.zeros(n)
        now = packed.q, v, rng.normal(size=n), lam
        S, by_v = by_velocity(packed, W, *now)
        K, by_q = by_position(packed, W, *now, step=1e-6)
        size = np.abs(S).max() + np.abs(K).max()
        assert_allclose(S, by_v, atol=1e-7 * size)
        if not viscosity:
            assert_allclose(K, by_q, atol=1e-7 * size)


def test_balance_of_energy_and_loss():
    rod = a_rod(viscosity=0.05)
    mech, part = clamped(rod, gravity=(0, 0, -9.81))
    mech.add_rigid("bob", mass=3.0, inertia=(0.1, 0.1, 0.1), at=(10, 0, 0))
    mech.spherical("ball", part.marker("end"), mech.part("bob").marker(ORIGIN))
    miss = []
    for dt in (0.01, 0.005):
        sol = rom.simulate(mech, t_end=2.0, dt=dt, rho_inf=1.0)
        turnover = np.ptp(sol.energy.potential)
        miss.append(np.abs(sol.energy.balance).max() / turnover)
        assert sol.energy.damping[-1] > 0.03 * turnover
    assert miss[1] < 0.3 * miss[0]
    assert miss[1] < 1e-3
    assert rom.audit(sol).ok


def test_a_free_rod_keeps_its_momentum():
    rod = a_rod()
    mech = rom.Mechanism(gravity=ORIGIN)
    pose = {"at": (1, 2, 3), "orientation": rotation.exp([0.3, 0.2, 0.1])}
    rates = {"velocity": (1, 0, -1), "omega": (0.5, 1.5, 2.0)}
    part = mech.add_nonlinear("rod", body(rod), **pose, **rates)
    drift = []
    for dt in (0.01, 0.005):
        sol = rom.simulate(mech, t_end=2.0, dt=dt, rho_inf=1.0)
        drift.append(max(np.abs(p - p[0]).max() / np.abs(p).max() for p in sol.momentum))
    assert drift[1] < 0.3 * drift[0]
    assert drift[1] < 3e-5
    A = rotation.matrix(pose["orientation"])
    speed = np.array([1, 0, -1]) + np.cross(A @ [0.5, 1.5, 2.0], A @ [5.0, 0, 0])  # of the middle
    assert_allclose(sol.momentum[0][0], 10 * speed, rtol=1e-12)
    arm = part.parts[-1].at - part.parts[0].at
    assert_allclose(arm, A @ [10, 0, 0], atol=1e-12)


def steel(b, h, E=210e9, rho=7850.0):
    """Section of a bar; axes y, z, along: a moment about y bends over z."""
    A, I = b * h, np.array([b * h**3, h * b**3]) / 12
    return {"stretch": E / 2.6 * A * np.array([5 / 6, 5 / 6, 2.6]),
            "bend": (E * I[0], E * I[1], E / 2.6 * 0.196 * b * h**3),
            "mass": rho * A, "inertia": rho * np.array([I[0], I[1], I.sum()])}  # fmt: skip


def test_a_rod_goes_on_where_a_reduced_solid_ends_and_has_its_frequencies():
    size, ends = (0.5, 0.03, 0.02), {"root": "rbe2", "tip": "rbe3"}
    solid = reduced(6, bar(size, (20, 2, 2)), interfaces=ends, reference="root")
    section = steel(*size[1:])
    half = body(cosserat.straight(0.5, 48, frame=ALONG_X, **section))
    whole = cosserat.straight(1.0, 96, frame=ALONG_X, **section)
    expected = cosserat.modes(whole, cosserat.reference(whole), 4).frequencies
    mech = rom.Mechanism(gravity=ORIGIN)
    first = mech.add_flexible("bar", solid, at=-solid.marker("root").point)
    mech.fixed("wall", mech.ground.marker(ORIGIN), first.marker("root"))
    tip = mech.design_point(first.marker("tip"))
    rod = mech.add_nonlinear("rod", half, at=tip)
    mech.fixed("weld", first.marker("tip"), rod.marker("start"))
    found = rom.linearize(mech, rom.equilibrium(mech)).frequencies[:4]
    assert_allclose(found, expected, rtol=4e-3)
    size = (1.0, 0.03, 0.02)
    solid = reduced(8, bar(size, (40, 2, 2)), interfaces={"root": "rbe3"})
    rod = cosserat.straight(1.0, 192, frame=ALONG_X, **steel(*size[1:]))
    found = cosserat.modes(rod, cosserat.reference(rod), 5).frequencies
    assert_allclose(found, solid.frequencies(fixed="root")[:5], rtol=3e-3)


def test_restart_gives_the_same_bits():
    rod = a_rod(5)
    mech, part = clamped(rod)
    mech.force("tip", part.marker("end"), (0, 20.0, 10.0))
    one = rom.simulate(mech, t_end=0.4, dt=0.01)
    half = rom.simulate(mech, t_end=0.2, dt=0.01)
    rest = rom.simulate(mech, state=half.final, t_end=0.4, dt=0.01)
    assert np.array_equal(one.q[-1], rest.q[-1])


def test_plates_take_their_inertia_from_the_segments_beside_them():
    rod = cosserat.straight(10.0, 5, **SECTION)
    frames = body(rod).frames
    assert_allclose(frames.inertia.sum(axis=0), rod.inertia.sum(axis=0), rtol=1e-14)
    assert_allclose(frames.inertia[[0, 1]], np.outer([0.5, 1.5], SECTION["inertia"]), rtol=1e-12)
    assert_allclose(frames.mass.sum(), 10.0, rtol=1e-14)
    own = rod._replace(inertia=rod.inertia + 1.0)
    assert_allclose(body(own).frames.inertia, own.inertia)


def test_a_released_rod_starts_from_the_shape_in_which_it_was_held():
    rod = a_rod()
    held, part = clamped(rod)
    held.spherical("hand", held.ground.marker((9.5, 0.0, 2.0)), part.marker("end"))
    rest = rom.equilibrium(held, assemble=True)
    loose, _ = clamped(rod)
    start = rom.release(loose, rest)
    assert_allclose(start.q, rest.q, atol=1e-12)
    assert start.lam.size == rest.lam.size - 3
    sol = rom.simulate(loose, state=start, t_end=1.0, dt=0.002, rho_inf=0.9)
    assert sol.energy.strain[0] > 1.0
    assert np.abs(sol.energy.balance).max() < 0.02 * sol.energy.strain[0]
    assert sol.position("rod.12")[-1, 2] < 1.5
    again = rom.release(loose, sol.final)
    assert_allclose(again.v, sol.final.v, atol=1e-8)
    assert np.abs(again.v).max() > 0.1
    assert again.t == sol.final.t
    other, _ = clamped(a_rod(4))
    refuses(ConfigError, "their bodies differ", rom.release, other, rest)


def test_pictures_of_a_rod_are_its_segments():
    mech, part = clamped(a_rod(4))
    boxes = view.sleeves(part, (0.2, 0.4))
    assert list(boxes) == [f"rod.{k}" for k in range(6)]
    points, _ = boxes["rod.2"]
    assert_allclose(np.ptp(points, axis=0), [0.2, 0.4, 2.5])
    assert_allclose(points.max(axis=0), [0.1, 0.2, 0.0], atol=1e-12)
    assert len(set(shades_of(mech).values())) == 1
    refuses(ConfigError, r"\(4, 2\) and positive", view.sleeves, part, np.ones((3, 2)))
    refuses(ConfigError, "positive", view.sleeves, part, (1.0, 0.0))


def test_elimination_along_the_rod_is_the_dense_solution():
    mech, _ = clamped(a_rod(9, viscosity=1e-3), gravity=(1, 2, 3))
    by_blocks, whole = pack(mech), pack(mech, whole=True)
    assert by_blocks.by_blocks
    assert not whole.by_blocks
    rng = np.random.default_rng(11)
    n = whole.v.size
    free = np.ones(n)
    free[:6] = free[-6:-3] = 0.0  # the clamp, and the place of the plate at the end
    q = whole.q.copy()
    d = 0.2 * rng.normal(size=n) * free
    d[-6:-3] = d[-12:-9]
    retract(whole.system, whole.q, d, q)
    v = rng.normal(size=n) * free
    v[-6:-3] = v[-12:-9]
    one, two = (initial_state(replace(p, q=q.copy(), v=v.copy())) for p in (by_blocks, whole))
    assert_allclose(one.q, q, atol=1e-12)
    assert_allclose(one.a, two.a, atol=1e-9 * np.abs(two.a).max())
    assert_allclose(one.lam, two.lam, atol=1e-9 * np.abs(two.lam).max())


def spring(numbers, pose, wanted, answer, _space):
    """A law from outside: a spring and a damper between two origins."""
    k, c, free = numbers[0], numbers[1], numbers[2]
    s, out = carray(pose, (26,)), carray(answer, (302,))
    out[:] = 0.0
    gap, rate = s[13:16] - s[0:3], s[20:23] - s[7:10]
    length = np.sqrt((gap * gap).sum())
    e = gap / length
    speed = (e * rate).sum()
    out[0], out[1] = 0.5 * k * (length - free) ** 2, c * speed**2
    tension = k * (length - free) + c * speed if length < numbers[3] else np.nan
    for i in range(3):
        out[2 + i], out[8 + i] = -tension * e[i], tension * e[i]
        for j in range(3):
            stiff = k * e[i] * e[j] + tension / length * ((i == j) - e[i] * e[j])
            for a in range(2):
                for b in range(2):
                    sign = 1.0 if a == b else -1.0
                    out[14 + 12 * (6 * a + i) + 6 * b + j] = sign * stiff
                    out[158 + 12 * (6 * a + i) + 6 * b + j] = sign * c * e[i] * e[j]


def two_masses(limit=np.inf):
    frames = Frames(np.array([[0.0, 0, 0], [2.0, 0, 0]]), np.tile([1.0, 0, 0, 0], (2, 1)),
                    np.array([1.0, 2.0]), np.full((2, 3), 0.1))  # fmt: skip
    law = cfunc("void(CPointer(f8), CPointer(f8), i8, CPointer(f8), CPointer(f8))")(spring)
    pair = Elements(law.address, np.array([[0, 1]]), np.array([[40.0, 0.3, 1.5, limit]]), law)
    return SimpleNamespace(frames=frames, elements=(pair,), places={"far": 1}, coincident=())


def test_a_law_of_the_user_is_as_good_as_a_force_of_the_core():
    mech = rom.Mechanism()
    pair = mech.add_nonlinear("pair", two_masses())
    mech.spherical("pivot", mech.ground.marker(ORIGIN), pair.marker(0))
    own = rom.simulate(mech, t_end=2.0, dt=0.005)
    mech = rom.Mechanism()
    one = mech.add_rigid("one", mass=1.0, inertia=(0.1,) * 3, at=ORIGIN)
    two = mech.add_rigid("two", mass=2.0, inertia=(0.1,) * 3, at=(2, 0, 0))
    mech.spherical("pivot", mech.ground.marker(ORIGIN), one.marker(ORIGIN))
    ends = one.marker(ORIGIN), two.marker(ORIGIN)
    mech.spring_damper("spring", *ends, stiffness=40, damping=0.3, free_length=1.5)
    core = rom.simulate(mech, t_end=2.0, dt=0.005)
    assert np.linalg.norm(core.q[-1, 7:10] - (2, 0, 0)) > 1
    assert_allclose(own.q, core.q, atol=1e-9)
    assert_allclose(own.energy.strain, core.energy.strain, atol=1e-8)
    assert_allclose(own.energy.damping, core.energy.damping, atol=1e-8)


def test_a_body_whose_law_fails_is_named_and_the_motion_so_far_is_kept():
    mech = rom.Mechanism()
    pair = mech.add_nonlinear("pair", two_masses(limit=2.2))
    mech.add_nonlinear("other", two_masses(), at=(0.0, 5.0, 0.0))
    mech.spherical("pivot", mech.ground.marker(ORIGIN), pair.marker(0))
    mech.force("pull", pair.marker(1), (100.0, 0.0, 0.0))
    words = r"t = 0\.\d+ s.*; the law of 'pair' gives no finite number"
    with pytest.raises(rom.SolverError, match=words) as caught:
        rom.simulate(mech, t_end=2.0, dt=0.005)
    reached = caught.value.solution.position("pair.1")[:, 0]
    assert 2.1 < reached[-1] < 2.2 and len(reached) > 5


def test_bad_bodies_are_named():
    mech = rom.Mechanism()
    light = cosserat.straight(1.0, 4, stretch=1.0, bend=1.0)
    refuses(ModelError, "without mass or inertia", body, light)
    pair = two_masses()
    pair.frames.mass[1] = 0.0
    refuses(ModelError, "frame 1 of 2 has mass 0 kg", mech.add_nonlinear, "pair", pair)
    pair.frames.mass[1] = 1.0
    pair.elements[0].frames[0, 1] = 2
    refuses(ModelError, "frames from 0 to 1", mech.add_nonlinear, "pair", pair)
    pair.elements[0].frames[0, 1] = 1
    part = mech.add_nonlinear("pair", pair)
    for place in ("near", True, 2, 1.0):
        refuses(ConfigError, r"pair|place = ", part.marker, place)
    body_of_that_name = {"mass": 1.0, "inertia": (1, 1, 1), "at": ORIGIN}
    refuses(ConfigError, "used twice", mech.add_rigid, "pair", **body_of_that_name)
    assert part.marker("far") == part.marker(1) == part.marker(-1)


def test_all_of_a_shaft_turns_behind_its_bearing():
    mech = rom.Mechanism(gravity=ORIGIN)
    shaft = mech.add_nonlinear("shaft", body(a_rod(6)))
    mech.revolute("bearing", mech.ground.marker(ORIGIN), shaft.marker("start"), axis=(1, 0, 0))
    stiff = (0.0, 1e3, 1e3, 0.0, 0.0, 0.0)
    mech.bushing("far", mech.ground.marker((10.0, 0, 0)), shaft.marker("end"), stiffness=stiff)
    turns = rom.snapshot(mech, rom.equilibrium(mech, spin={"bearing": 3.0}))
    for k in range(len(shaft.parts)):
        A = rotation.matrix(turns.orientation(f"shaft.{k}")[0])
        assert_allclose(A @ turns.omega(f"shaft.{k}")[0], [3.0, 0, 0], atol=1e-9)
