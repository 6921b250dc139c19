"""One body of coupled bodies against the same block reduced in one piece, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.halves import COUPLED, ROOT, halves, joined
from cases.refusals import refuses
from cases.solid import STEEL, block, reduced
from rom.body.recovery import StressRecovery, centrifugal
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, ModelError, RomWarning

BAR = {"size": (1.0, 0.1, 0.08), "cells": (8, 2, 2)}
pytestmark = pytest.mark.filterwarnings("ignore:the certificate of body:rom.errors.RomWarning")


def one_piece(n_modes=None):
    model = block(**BAR)
    inner = model.n_dofs - sum(i.dofs.size for i in model.interfaces.values())
    return reduced(inner if n_modes is None else n_modes, model)


def same_bodies(found, expected, rtol=1e-7):
    """All that a mechanism reads, up to the signs of the shapes."""
    for name in ("mass", "first_moment", "inertia"):
        scale = np.abs(getattr(expected, name)).max()
        assert_allclose(getattr(found, name), getattr(expected, name), atol=1e-9 * scale)
    assert_allclose(found.omega, expected.omega, rtol=1e-9)
    place = {tuple(x): k for k, x in enumerate(found.surface.points.round(9))}
    order = [place[tuple(x)] for x in expected.surface.points.round(9)]
    r = expected.n_modes
    ours = found.surface.shape.reshape(-1, 3, r)[order].reshape(-1, r)
    sign = np.sign(np.einsum("nk,nk->k", ours, expected.surface.shape))
    scale = np.abs(expected.surface.shape).max()
    assert_allclose(ours * sign, expected.surface.shape, atol=rtol * scale)
    size, weight = found.size, np.sqrt(found.mass)  # of mass-normalised shapes
    signs = np.r_[np.ones(6), sign]
    assert_allclose(found.S * sign, expected.S, atol=rtol * weight)
    assert_allclose(found.Ibar_kl * sign, expected.Ibar_kl, atol=rtol * weight * size)
    assert_allclose(found.S_kl * np.outer(sign, sign), expected.S_kl, atol=rtol)
    assert set(found.markers) == set(expected.markers)
    for name, known in expected.markers.items():
        own = found.markers[name]
        assert own.name == name and own.kind == known.kind
        assert_allclose(own.point, known.point, atol=1e-12)
        assert_allclose(own.translation * sign, known.translation, atol=rtol * scale)
        assert_allclose(own.rotation * sign, known.rotation, atol=10 * rtol * scale / size)
        assert_allclose(own.hold * signs, known.hold, atol=10 * rtol * np.abs(known.hold).max())


def test_two_halves_joined_with_all_modes_are_the_whole_body():
    found, expected = joined("full").body("bar"), one_piece()
    same_bodies(found, expected)
    assert found.reference == "mean-axis" and found.name == "bar"
    assert found.labels == expected.labels
    areas = found.surface_areas()
    outside = 2 * (1.0 * 0.1 + 1.0 * 0.08 + 0.1 * 0.08)
    assert_allclose(areas.sum(), outside + 2 * 0.1 * 0.08)  # with both sides of the seam
    assert_allclose(areas @ found.surface.points / areas.sum(), [0.5, 0.05, 0.04])
    for fixed in ((), ("root",), ("root", "tip")):
        known = expected.frequencies(12, fixed=fixed)
        assert_allclose(found.frequencies(12, fixed=fixed), known, rtol=1e-8, atol=1e-6)


@pytest.mark.parametrize("frames", [("root", "tip"), ("tip", ("root", "tip"))])
def test_the_frames_of_the_halves_do_not_matter(frames):
    bodies = halves("full")
    assembly = joined("full")
    turned = {n: bodies[n].with_reference(f) for n, f in zip(bodies, frames, strict=True)}
    found = rom.Assembly(turned, COUPLED).body(n_modes=8, reference="root")
    assert found.reference == "root"
    same_bodies(found, assembly.body(n_modes=8).with_reference("root"), rtol=1e-6)


@pytest.mark.parametrize(("limit", "n"), [({"n_modes": 8}, 8), ({"f_max": 3300.0}, 8)])
def test_few_modes_are_those_of_craig_and_bampton_and_statics_stay_exact(limit, n):
    found, expected = joined("full").body(**limit), one_piece(n)
    assert found.n_modes == 6 + n
    same_bodies(found, expected)
    load = {"tip": (30.0, -50.0, 20.0, 1.0, 2.0, 3.0)}
    tips = []
    for body in (found, one_piece()):
        held = body.with_reference("root")
        q = np.linalg.solve(held.K, held.forces_on(load))
        tips.append(held.marker("tip").translation @ q)
    assert_allclose(tips[0], tips[1], rtol=1e-7)


def test_a_body_without_interfaces_keeps_the_lowest_free_modes():
    found = joined("full").body(interfaces=(), n_modes=5)
    assert found.markers == {}
    assert_allclose(found.omega, one_piece().omega[:5], rtol=1e-9)
    refuses(ConfigError, "whole number from 0 to 195", joined("full").body, interfaces=(),
            n_modes=196)  # fmt: skip


def test_mass_and_inertia_are_those_of_a_block_and_a_pendulum_of_it_has_its_period():
    """Compound pendulum about an edge of the face x = 0, of a steel without any give."""
    rigid = replace(STEEL, E=50 * STEEL.E)
    ends = {"left": (0.0, {"root": "rbe2", "tip": "full"}),
            "right": (0.5, {"root": "full", "tip": "rbe2"})}  # fmt: skip
    bodies = {
        side: reduced(2, block((0.5, 0.1, 0.08), (2, 1, 1), rigid, (x, 0, 0)), interfaces=kinds)
        for side, (x, kinds) in ends.items()
    }
    body = rom.Assembly(bodies, COUPLED).body(n_modes=2)
    L, b, h = 1.0, 0.1, 0.08
    m = STEEL.rho * L * b * h
    assert_allclose(body.mass, m, rtol=1e-12)
    assert_allclose(body.first_moment, m * np.array([L, b, h]) / 2, rtol=1e-12)
    x, y, z = L, b, h
    products = -m / 4 * np.array([[0, x * y, x * z], [x * y, 0, y * z], [x * z, y * z, 0]])
    about = np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2]) * m / 3
    assert_allclose(body.inertia, about + products, rtol=1e-11)
    mech = rom.Mechanism(gravity=(9.81, 0, 0))
    part = mech.add_flexible("bar", body)
    mech.revolute("hinge", mech.ground.marker((0, b / 2, h / 2)), part.marker("root"),
                  axis=(0, 0, 1))  # fmt: skip
    lowest = rom.linearize(mech, rom.equilibrium(mech)).frequencies[0]
    arm = m * (L**2 + b**2) / 12 + m * L**2 / 4
    assert_allclose(lowest, np.sqrt(m * 9.81 * L / 2 / arm) / (2 * np.pi), rtol=1e-6)


def test_both_swing_alike():
    ends = []
    for body in (joined("full").body(n_modes=4), one_piece(4)):
        mech = rom.Mechanism(gravity=(0, -9.81, 0))
        part = mech.add_flexible("bar", body)
        mech.revolute("hinge", mech.ground.marker((0, 0.05, 0.04)), part.marker("root"),
                      axis=(0, 0, 1))  # fmt: skip
        mech.force("pull", part.marker("tip"), (0.0, 4e4, 2e3))
        found = rom.simulate(mech, t_end=0.05, dt=5e-4)
        ends.append(found.position("bar", "tip"))
    assert np.ptp(ends[1], axis=0).max() > 0.1
    assert_allclose(ends[0], ends[1], atol=1e-6 * np.ptp(ends[1], axis=0).max())


def test_damping_is_that_of_the_parts_or_another():
    """Stiffness-proportional damping of both halves is that of the whole."""
    beta = rom.Rayleigh(beta=2e-5)
    bodies = {n: replace(b, D=beta.matrix(b)) for n, b in halves("full").items()}
    assembly = rom.Assembly(bodies, COUPLED)
    found = assembly.body(n_modes=6)
    assert_allclose(found.D, 2e-5 * found.K, atol=1e-9 * np.abs(found.K).max() * 2e-5)
    assert_allclose(assembly.body(n_modes=6, damping=rom.ModalDamping(0.01)).D,
                    np.diag(0.02 * found.omega), atol=1e-9 * found.omega.max())  # fmt: skip


def test_interfaces_are_named_so_that_they_can_be_told_apart():
    kinds = {"root": "rbe2", "tip": "full"}
    left = reduced(4, block((0.5, 0.1, 0.08), (4, 2, 2)), interfaces=kinds)
    right = reduced(4, block((0.5, 0.1, 0.08), (4, 2, 2), origin=(0.5, 0, 0)),
                    interfaces={"root": "full", "tip": "full"})  # fmt: skip
    pair = rom.Assembly({"left": left, "right": right}, COUPLED)
    assert set(pair.body(n_modes=2).markers) == {"root", "tip"}
    twice = (("left", "root"), ("right", "root"))
    assert set(pair.body(n_modes=2, interfaces=twice).markers) == {"left.root", "right.root"}
    own = pair.body(n_modes=2, interfaces={"foot": ("left", "root"), "seam": ("left", "tip")})
    assert [own.markers[n].name for n in ("foot", "seam")] == ["foot", "seam"]
    assert_allclose(own.marker("seam").point, [0.5, 0.05, 0.04])
    assert own.certificate.worst.quantity.startswith(("left:", "right:"))
    refuses(InterfaceError, "no interface 'top'", pair.body, interfaces=(("left", "top"),))
    refuses(ConfigError, "no body 'middle'", pair.body, interfaces=(("middle", "top"),))
    refuses(ConfigError, "is given twice", pair.body, interfaces=(ROOT, ROOT))
    refuses(ConfigError, "n_modes or f_max, not both", pair.body, n_modes=2, f_max=1.0)


def test_a_mechanism_is_no_body():
    bodies = halves("full", n_modes=4)
    third = reduced(2, block((0.5, 0.1, 0.08), (4, 2, 2), origin=(2.0, 0, 0)))
    more = bodies | {"third": third}
    refuses(ModelError, "'third' can move against 'left' without strain",
            rom.Assembly(more, COUPLED).body)  # fmt: skip
    refuses(ModelError, "'right' can move against 'left'", rom.Assembly(bodies, ()).body)
    alone = rom.Assembly({"third": third}, ()).body()
    assert_allclose(alone.omega, third.omega, rtol=1e-9)


def test_few_interface_functions_make_a_body_with_their_frequencies():
    assembly = joined("full", n_modes=20)
    condensed = assembly.reduced(9)
    body = condensed.body("few")
    assert_allclose(body.frequencies(12), condensed.frequencies(12), rtol=1e-9, atol=1e-6)
    assert body.n_modes == condensed.M.shape[0] - 6 and body.name == "few"
    held = assembly.reduced(9, fixed=(ROOT,))
    refuses(ConfigError, "these motions hold the whole", held.body)


def test_the_certificate_knows_all_parts_and_fails_with_too_few_modes(tmp_path):
    good = rom.Report("certificate", (rom.model.Row("mass", 0.0, "<= 1e-09", True),))
    bodies = {n: replace(b, certificate=good) for n, b in halves("full").items()}
    assembly = rom.Assembly(bodies, COUPLED)
    report = rom.load(rom.save(assembly.body("bar"), tmp_path / "bar.npz")).certificate
    assert report.ok and report.title == "certificate of bar"
    worst = {line.quantity: line.value for line in report.rows}
    assert {"left: mass", "gap of coupled interfaces, over their motion"} <= set(worst)
    for support in ("free", "root held", "tip held"):
        assert worst[f"{support}: worst error of 6 frequencies"] < 1e-8
    failures = assembly.body("bar", n_modes=1).certificate.failures
    assert {line.quantity.split(":")[0] for line in failures} == {"free", "root held", "tip held"}


def test_stress_is_that_of_the_parts_and_stiffening_is_left_out_aloud():
    """Of strains of the surface, and of accelerations of its points, whatever the frame."""
    bodies = halves("full", n_modes=6)

    def strained(shape, points):
        edge = points[1:] - points[:-1]
        moved = np.diff(shape.reshape(len(points), 3, -1), axis=0)
        along = np.einsum("na,nak->nk", edge, moved)
        return np.repeat(np.vstack([along, along[:1]]), 6, axis=0)

    def accelerated(shape, points):
        return np.tile(np.hstack([rigid_motions(points), centrifugal(points), shape]), (2, 1))

    def with_stress(body):
        points, shape = body.surface.points, body.surface.shape
        found = strained(shape, points), accelerated(shape, points)
        return replace(body, stress=StressRecovery(points, *found))

    stressed = {n: with_stress(b) for n, b in bodies.items()}
    found = rom.Assembly(stressed, COUPLED).body(n_modes=3)
    first = len(bodies["left"].surface.points)
    shape, points = found.surface.shape, found.surface.points
    each = list(zip(np.split(shape, [3 * first]), np.split(points, [first]), strict=True))
    for law, own in ((strained, found.stress.operator), (accelerated, found.stress.inertial)):
        known = np.vstack([law(*half) for half in each])
        assert_allclose(own, known, atol=1e-9 * np.abs(known).max())
    assert found.stress.fits(found.n_modes)
    left = replace(stressed["left"].stress, inertial=None)
    blind = stressed | {"left": replace(bodies["left"], stress=left)}
    assert rom.Assembly(blind, COUPLED).body(n_modes=3).stress.inertial is None
    some = stressed | {"right": bodies["right"]}
    assert rom.Assembly(some, COUPLED).body(n_modes=3).stress is None
    bare = bodies | {"right": replace(bodies["right"], surface=None)}
    assert rom.Assembly(bare, COUPLED).body(n_modes=3).surface is None
    K = {"a_x": np.eye(bodies["left"].n_modes)}
    stiff = bodies | {"left": replace(bodies["left"], K_geo=K)}
    with pytest.warns(RomWarning, match="'left' has geometric stiffness, .* goes without"):
        assert not rom.Assembly(stiff, COUPLED).body(n_modes=3).K_geo
