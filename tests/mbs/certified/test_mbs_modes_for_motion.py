"""Modes chosen by what they are worth to a motion."""

import numpy as np
import pytest
from mbs.certified.machines import ALL, beam, crank, moved, ramp
from numpy.testing import assert_allclose

import rom
from cases.long import few
from cases.paths import ROOT
from cases.refusals import refuses
from cases.solid import STEEL
from rom.mbs.analysis.motion_certificate import deformation, hot_points, largest_stress

# part: its interfaces, the mode with both held at whose frequency the second is pushed, tolerance
PARTS = [("flexure", "base", "drive", 3, 5e-4), ("connecting_rod", "pin_a", "pin_b", 3, 2e-3),
         ("beam", "root", "tip", 6, 5e-4)]  # fmt: skip


def kept(body):
    """(m,) which modes stayed."""
    return np.array(
        [row[2] for row in body.provenance["for motion"]["modes: frequency, worth, kept"]]
    )


def missed(less, more):
    """Largest error of the deformation of the rod, of its largest value."""
    one, two = (deformation(motion, "rod") for motion in (less, more))
    return np.linalg.norm(two - one, axis=1).max() / np.linalg.norm(two, axis=1).max()


def test_a_rod_in_a_plane_keeps_modes_of_that_plane_alone():
    """By frequency every second mode bends out of the plane, where nothing pulls."""
    whole = beam(ALL)
    motion = moved(crank, whole)
    chosen = whole.for_motion(motion, name="rod", tol=1e-4)
    assert missed(moved(crank, chosen), motion) < 3e-4
    number = int(kept(chosen).sum())
    assert missed(moved(crank, beam(number, spare=False)), motion) > 3e-3
    shapes = chosen.surface.shape.reshape(-1, 3, chosen.n_modes)
    held = chosen.modes(fixed=("root", "tip")).shapes[6:]
    across, upright = (np.abs(shapes[:, k] @ held).max(axis=0)[:2] for k in (1, 2))
    assert (upright > 10 * across).all()


def test_statics_and_mass_stay_whatever_is_chosen():
    whole = beam(12)
    chosen = whole.for_motion(moved(crank, whole), name="rod", tol=0.5)
    assert not kept(chosen).any() and chosen.n_modes == 6
    assert chosen.certificate is None and chosen.reference == whole.reference
    assert_allclose(chosen.inertia, whole.inertia)
    load = {"tip": (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)}
    at_tip = [body.marker("tip") for body in (whole, chosen)]
    bent = [np.linalg.solve(b.K, b.forces_on(load)) for b in (whole, chosen)]
    for kind in ("translation", "rotation"):
        one, two = (getattr(m, kind) @ q for m, q in zip(at_tip, bent, strict=True))
        assert_allclose(two, one, rtol=1e-6)


def test_a_motion_that_was_corrected_tells_which_modes_to_add():
    less, more = beam(0, spare=False), beam(12, spare=False)
    motion = moved(crank, less)
    report = rom.certify_motion(motion, {"rod": more})
    chosen = more.for_motion(report.motion, name="rod", tol=1e-3)
    assert 0 < kept(chosen).sum() < 6
    assert not report.ok and rom.certify_motion(moved(crank, chosen), {"rod": more}, tol=6e-3).ok


def test_what_cannot_be_chosen_from_is_refused():
    less, more = beam(1, spare=False), beam(12)
    motion = moved(crank, less)
    refuses(rom.ConfigError, "has not the coordinates of body", more.for_motion, motion, name="rod")
    refuses(rom.ConfigError, "no body|has no body|'beam'", more.for_motion, motion)
    refuses(
        rom.ConfigError,
        "reduce it with stress=True",
        less.for_motion,
        motion,
        name="rod",
        goal="stress",
    )


@pytest.mark.fenicsx
def test_the_static_stress_of_modes_left_out_is_that_of_a_body_that_never_had_them():
    """Rows of the frame, products of angular velocities included: finite elements know them."""
    model = rom.fe.model(ROOT / "meshes" / "flexure.geo", material=STEEL)
    how = {"interfaces": {"base": "rbe2", "drive": "rbe2"}, "certify": False, "stress": True}
    whole, bare = (rom.reduce(model, method=rom.CraigBampton(n), **how) for n in (12, 0))
    mech = rom.Mechanism()
    mech.add_flexible("body", whole)
    chosen = whole.for_motion(rom.simulate(mech, t_end=1e-3, dt=1e-3), goal="stress", tol=0.99)
    assert chosen.n_modes == bare.n_modes == 6
    at, beside = chosen.stress.inertial[:, :12], bare.stress.inertial[:, :12]
    assert_allclose(at, beside, rtol=0, atol=1e-5 * np.abs(beside).max(axis=0).min())
    turn = np.linalg.lstsq(bare.surface.shape, chosen.surface.shape, rcond=None)[0]
    at, beside = chosen.stress.inertial[:, 12:], bare.stress.inertial[:, 12:] @ turn
    assert_allclose(at, beside, rtol=0, atol=1e-5 * np.abs(beside).max())


@pytest.mark.fenicsx
@pytest.mark.parametrize("part", few(1, [[x] for x in PARTS]))
def test_one_per_cent_of_stress_takes_fewer_modes_than_by_frequency(part):
    """At most 60 % of those that Craig-Bampton by frequency needs, whose number misses it."""
    ((name, a, b, mode, tol),) = part
    model = rom.fe.model(ROOT / "meshes" / f"{name}.geo", material=STEEL)

    def body(n):
        return rom.reduce(
            model, method=rom.CraigBampton(n), interfaces={a: "rbe2", b: "rbe2"}, certify=False,
            name=name, stress=True, damping=rom.ModalDamping(0.01, fixed=(a,)),
        )  # fmt: skip

    whole = body(40)
    held = whole.frequencies(fixed=(a, b))
    f = held[held > 0][mode]

    def pushed(body):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        bar = mech.add_flexible(name, body)
        mech.fixed("wall", mech.ground.marker(tuple(body.marker(a).point)), bar.marker(a))

        def push(t):
            return 0, 1e3 * ramp(t, 5 / f) * np.sin(2 * np.pi * f * t), 0

        mech.force("push", bar.marker(b), push)
        return rom.simulate(mech, t_end=15 / f, dt=1 / f / 40, rho_inf=0.9)

    motion = pushed(whole)
    hot = hot_points(motion, name)
    true = largest_stress(motion, name, hot)

    def error(body):
        return np.abs(largest_stress(pushed(body), name, hot) - true).max() / true.max()

    chosen = whole.for_motion(motion, goal="stress", tol=tol)
    number = int(kept(chosen).sum())
    assert error(chosen) < 0.01 < error(body(int(number / 0.6)))
