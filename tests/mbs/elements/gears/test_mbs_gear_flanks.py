"""Measured flanks, run-out, contact by Hertz, slices that carry each other, stiffness."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq, lsq_linear

import rom
from cases.components.geared import ORIGIN, free_wheels
from cases.mbs.mechanisms import prepared, residual_at
from cases.mbs.parts import on_axle
from cases.mbs.tangents import shifted
from cases.refusals import refused, refuses
from rom.components import gear_mesh
from rom.components.gear_mesh import Correction, GearPair, Hertz, bending_table, contact_compliance
from rom.components.gear_mesh.gears import meshes, table

K = 1.3e10
SPUR = GearPair((26, 40), 4e-3, 0.03, thinning=5e-5)
RING = GearPair((24, -72), 2e-3, 0.02, thinning=2e-5)
CELLS = 6
HELIX_OF_BASE = replace(SPUR, helix=0.35).base_helix
LOAD = 3e5  # along the line of action, over the face [N/m]


def wheels(pair=SPUR, at=(ORIGIN, ORIGIN), **more):
    """Two wheels in mesh, whose markers may be off their axes; packed, and its memory."""
    given = {"stiffness": K, "cells": CELLS, "entry": 0.0, "conservative": False} | more
    return prepared(free_wheels(pair, at=at, inertia=(1e-3,) * 3, **given))


def load_at(found, turns, phase=None):
    """Sum of the normal forces when the wheels have turned [N]."""
    if phase is not None:
        found[0].elements[meshes.GEAR_MESHES_FAMILY].size[0, table.PHASE] = phase
    return load_moved(found, dict(zip((5, 11), turns, strict=True)))


def load_moved(found, moves):
    """Sum of the normal forces after motions of both wheels {number: way or turn} [N]."""
    packed, W = found
    delta, none = np.zeros(12), np.zeros(12)
    delta[list(moves)] = list(moves.values())
    residual_at(packed.system, W, shifted(packed, packed.q, delta), none, none, np.zeros(0))
    return packed.elements[meshes.GEAR_MESHES_FAMILY].load[0]


def on_grid(values, tooth, u, z, width):
    """A map by SciPy."""
    one = values[tooth % len(values)]
    axes = np.linspace(0, 1, one.shape[0]), np.linspace(-width / 2, width / 2, one.shape[1])
    return RegularGridInterpolator(axes, one)(np.column_stack([np.full(z.shape, u), z]))


def gaps_at(maps, at):
    """(lines, cells) gaps of the slices of all lines that are on the path, line 0 at a place."""
    (A, B), found = SPUR.path, []
    z = SPUR.width * ((np.arange(CELLS) + 0.5) / CELLS - 0.5)
    for line in np.arange(-3, 4) - int(np.floor(at / SPUR.base_pitch)):
        u = (at + line * SPUR.base_pitch - A) / (B - A)
        if 0 <= u < 1:
            both = zip(maps, (u, 1 - u), strict=True)
            found.append(sum(on_grid(m, -line, v, z, SPUR.width) for m, v in both))
    return np.array(found)


def some_maps(seed=0):
    rng = np.random.default_rng(seed)
    return [1e-6 * rng.random(shape) for shape in ((26, 4, 3), (40, 5, 2))]


@pytest.mark.parametrize("phase", [0.13, 0.3, 40.2, -3.1])
def test_slices_bear_over_the_maps_of_both_wheels(phase):
    """Load of every slice by hand, of the right tooth, also after many turns."""
    maps, rb, depth = some_maps(), SPUR.rb[0], 2.5e-6
    found = wheels(correction=Correction(maps=tuple(maps)), phase=phase)
    gaps = gaps_at(maps, rb * phase + depth)
    wanted = K * SPUR.width / CELLS * np.clip(depth - gaps, 0, None).sum()
    assert wanted > 10
    assert load_at(found, (depth / rb, 0.0)) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("pair", [SPUR, replace(SPUR, helix=0.35), RING],
                         ids=["spur", "helical", "internal"])  # fmt: skip
def test_perfect_wheels_turn_by_their_ratio(pair):
    """They begin to touch within 1e-12 m of where they do, wherever they have rolled to."""
    found, (r1, r2) = wheels(pair, phase=0.3), pair.rb
    for turn in np.linspace(-3.0, 3.0, 13):
        ends = [load_at(found, (turn + x / r1, -turn * r1 / r2)) for x in (-1e-12, 1e-12)]
        assert ends[0] == 0.0
        assert ends[1] > 0.0


@pytest.mark.parametrize("phase", [0.13, 40.2])
def test_without_load_the_error_of_transmission_is_the_least_gap_of_the_map(phase):
    maps = some_maps(3)
    found, rb = wheels(correction=Correction(maps=tuple(maps))), SPUR.rb[0]
    low, high = 0.0, 1e-5
    while high - low > 1e-15:
        middle = 0.5 * (low + high)
        touching = load_at(found, (middle / rb, 0.0), phase - middle / rb) > 0.0
        low, high = (low, middle) if touching else (middle, high)
    assert high == pytest.approx(gaps_at(maps, rb * phase).min(), abs=1e-12)


def test_back_flanks_have_maps_of_their_own_and_know_their_teeth():
    """One tooth of each wheel lacks material behind, the pinion's or the one that follows it.

    The back flank of tooth i of the pinion follows its working flank, at rb phase - i p on the base
    circle, by its thickness, and counts from the other tangent. A tooth of the gear is pushed by
    the one of its number; behind it is that of the number before.
    """
    rb, b = SPUR.rb[0], SPUR.width
    lacking = [np.zeros((z, 1, 1)) for z in SPUR.teeth]
    found, depth = wheels(), 1e-6
    back = -(SPUR.backlash + depth) / rb
    whole = load_at(found, (back, 0.0), 0.1)
    lines = round(whole / (K * b * depth))
    assert lines in (1, 2)
    teeth = np.arange(-13, 13)
    behind = SPUR.base_thickness[0] + 2 * rb * SPUR.alpha - (rb * 0.1 + rb * back)
    places = behind + teeth * SPUR.base_pitch
    touching = teeth[(places >= SPUR.path[0]) & (places < SPUR.path[1])]
    assert touching.size == lines
    for wheel in range(2):
        fewer = []
        for tooth in range(SPUR.teeth[wheel]):
            maps = [x.copy() for x in lacking]
            maps[wheel][tooth] = 1e-3
            now = wheels(correction=Correction(back_maps=tuple(maps)))
            fewer.append(round((whole - load_at(now, (back, 0.0), 0.1)) / (K * b * depth)))
        assert sum(fewer) == lines
        assert set(np.flatnonzero(fewer)) == {(i + wheel) % SPUR.teeth[wheel] for i in touching}


def test_a_file_of_numbers_is_a_map(tmp_path):
    maps = some_maps()[0]
    path = tmp_path / "pinion.csv"
    path.write_text("\n\n".join("\n".join(",".join(map(repr, map(float, line))) for line in tooth)
                                for tooth in maps))  # fmt: skip
    assert_allclose(gear_mesh.flank_map(path), maps)
    for text, words in (("1,2\n3\n", ""), ("1,2\n3,x\n", "'x'")):
        path.write_text(text)
        found = rf"pinion\.csv is no map of flanks: .*{words}"
        refuses(rom.ModelError, found, gear_mesh.flank_map, path)


@pytest.mark.parametrize("pair", [SPUR, RING], ids=["external", "internal"])
@pytest.mark.parametrize("wheel", [0, 1])
@pytest.mark.parametrize("back", [False, True], ids=["working", "back"])
def test_run_out_is_what_a_wheel_off_its_axis_does(pair, wheel, back):
    """To first order in how far: 1 micrometre against the centre of the involutes elsewhere."""
    amount, towards, (r1, r2) = 1e-6, 0.7, pair.rb
    phase = 0.5 * sum(pair.path) / r1  # one line touches in the middle of its path
    if back:
        phase = (float(pair.base_thickness[0]) + 2 * r1 * pair.alpha) / r1 - phase
    mesh_side = 0.0 if wheel == 0 or pair.internal else np.pi  # of this wheel, where they mesh
    place, angle = [ORIGIN, ORIGIN], mesh_side + towards
    place[wheel] = (amount * np.cos(angle), amount * np.sin(angle), 0.0)
    given = [(0.0, 0.0), (0.0, 0.0)]
    given[wheel] = (amount, towards)
    pair = replace(pair, thinning=4e-4)
    moved = wheels(pair, tuple(place))
    thought = wheels(pair, correction=Correction(run_out=tuple(given)))
    depth, depths = 1e-5, []
    for step in range(-10, 11, 3):  # less than half a turn: angles are followed
        turn = 2 * np.pi / pair.teeth[0] * step
        close = (-pair.backlash - depth if back else depth) / r1
        turns = turn + close, -turn * r1 / r2
        depths.append([load_at(x, turns, phase) / (K * pair.width) for x in (moved, thought)])
    one, two = np.array(depths).T
    assert np.ptp(one) > 5e-7
    assert_allclose(two - two[0], one - one[0], atol=2e-3 * amount)


def test_shifts_and_tilts_alone_press_flanks():
    helical, depth, lean = replace(SPUR, helix=0.35), 1e-5, 1e-3
    phase, length = 0.5 * sum(helical.path) / helical.rb[0], helical.width / np.cos(HELIX_OF_BASE)
    for side, gap in ((1.0, 0.0), (-1.0, helical.backlash * np.cos(HELIX_OF_BASE))):
        found = wheels(helical, phase=phase)
        load = load_moved(found, {8: side * (depth + gap) / np.sin(HELIX_OF_BASE)})
        assert 0.9 * length < load / (K * depth) < 2.1 * length  # of one line or two
    z = SPUR.width * ((np.arange(CELLS) + 0.5) / CELLS - 0.5)
    one = K * SPUR.width / CELLS * np.clip(z * lean * np.cos(SPUR.alpha), 0, None).sum()
    found = wheels(phase=0.5 * sum(SPUR.path) / SPUR.rb[0])
    assert load_moved(found, {9: lean, 5: -1e-9}) == pytest.approx(one, rel=1e-4)


@pytest.mark.parametrize("back", [False, True], ids=["working", "back"])
def test_a_narrow_wheel_that_tilts_presses_by_its_radius(back):
    """About the direction across the line of centres; its teeth go along the axis, by hand."""
    narrow, side = replace(SPUR, helix=0.35, width=5e-3, thinning=4e-4), -1.0 if back else 1.0
    found, lean = wheels(narrow, phase=0.5 * sum(narrow.path) / narrow.rb[0]), 2e-3
    r = 40 * 4e-3 / np.cos(0.35) / 2  # of the gear, which rolls on it here
    apart = 0.5 * lean * r * np.tan(narrow.base_helix)  # half of what the tilt closes
    turn = -side * apart - (narrow.backlash if back else 0.0)
    loads = [load_moved(found, {5: turn / narrow.rb[0], 10: sign * lean}) for sign in (-1, 1)]
    depth = apart * np.cos(narrow.base_helix)
    assert min(loads) == 0.0
    assert 0.7 < max(loads) / (K * narrow.width * depth) < 2.4  # of one line or two


@pytest.mark.parametrize("given", ["crowning", "relief", "run_out", "maps"])
def test_material_beyond_the_involute_presses_at_the_datum(given):
    """Flanks that stand out bear although the wheels have not turned; by hand."""
    phase, out, z = 0.5 * sum(SPUR.path) / SPUR.rb[0], 4e-6, np.linspace(-0.5, 0.5, CELLS + 1)
    middle, even = 0.5 * (z[1:] + z[:-1]), np.full(CELLS, out)
    flanks, wanted = {
        "crowning": (Correction(crowning=-out), out * (2 * middle) ** 2),
        "relief": (Correction(relief=(-out, 0.0), extent=(1e3, 1.0)), even),
        "run_out": (Correction(run_out=((out, np.pi / 2 - SPUR.alpha), (0, 0))), even),
        "maps": (Correction(maps=(None, np.full((2, 2), -out))), even),
    }[given]
    load = load_moved(wheels(correction=flanks, phase=phase), {5: -1e-10})
    assert load == pytest.approx(K * SPUR.width * wanted.mean(), rel=1e-4)


def test_a_slice_solves_bending_and_hertz_for_its_load():
    """One line at the pitch point, against a root by SciPy; the whole of the path by the energy."""
    k, h, E = 2e10, (4e-3, 3e-3), 206e9
    found = wheels(hertz=Hertz(h, E), stiffness=k)
    radii = SPUR.pitch_point, SPUR.tangents - SPUR.pitch_point
    phase = SPUR.pitch_point / SPUR.rb[0]
    for depth in (1e-9, 1e-7, 1e-5, 3e-5):
        wanted = brentq(lambda F, d=depth: F / k + F * contact_compliance(radii, h, F, E) / E - d,
                        1e-9, 1e8, xtol=1e-12, rtol=1e-14)  # fmt: skip
        turn = depth / SPUR.rb[0]
        load = load_at(found, (turn, 0.0), phase - turn) / SPUR.width
        assert load == pytest.approx(wanted, rel=2e-3)  # the table of the constant is linear


@pytest.mark.parametrize(("teeth", "module", "wanted"), [
    ((26, 157), 4e-3, 16.91), ((50, 50), 3e-3, 16.39), ((25, 25), 4e-3, 15.77)])  # fmt: skip
def test_bending_with_hertz_is_that_of_weber_and_banaschek_at_one_load(teeth, module, wanted):
    """By another program at 300 N/mm with slightly other fillets, N/(mm um) at the pitch point."""
    pair = GearPair(teeth, module, 0.04)
    stiffness, hertz = bending_table(pair, n=401)
    found, force = wheels(pair, stiffness=stiffness, hertz=hertz), 3e5
    phase = pair.pitch_point / pair.rb[0]

    def off(depth):
        turn = depth / pair.rb[0]
        return load_at(found, (turn, 0.0), phase - turn) / pair.width - force

    depth = brentq(off, 1e-7, 1e-4, xtol=1e-16)
    assert force / depth * 1e-9 == pytest.approx(wanted, rel=0.015)
    secant = gear_mesh.pair_stiffness(pair, pair.pitch_point, force=force)
    assert force / depth == pytest.approx(secant, rel=3e-4)


def test_helical_teeth_are_rounder_in_their_normal_section():
    """Radii of curvature are those of the transverse section over the cosine of the base helix."""
    pair, h, F = replace(SPUR, helix=0.5, gear_helix=-0.5), (4e-3, 3e-3), 2e5
    hertz = Hertz(h)
    found = hertz.constants(pair)
    s = np.linspace(*pair.path, len(found))
    normal = np.array([s, pair.tangents - s]) / np.cos(pair.base_helix)
    wanted = [contact_compliance(radii, h, F, hertz.E) / hertz.E for radii in normal.T]
    assert_allclose(hertz.compliance * (found - 2 * np.log(F)), wanted, rtol=1e-12)


def pressed(gaps, depth, **more):
    """Load of one line over its stiffness [m^2], the gaps given at ends and middles of slices."""
    n = (len(gaps) - 1) // 2
    lead = Correction(maps=(np.tile(gaps, (2, 1)), None))
    phase = 0.5 * sum(SPUR.path) / SPUR.rb[0]
    found = wheels(cells=n, correction=lead, **more)
    return load_at(found, (depth / SPUR.rb[0], 0.0), phase) / K


def steps(touching):
    """Gaps at ends and middles of slices, none where they touch."""
    middle = np.where(touching, 0.0, 1e-3)
    return np.concatenate([[middle[0]], np.repeat(middle, 2)])[: 2 * middle.size + 1]


@pytest.mark.parametrize("n", [2, 21])
def test_coupling_does_nothing_to_an_even_load(n):
    flat = np.zeros(2 * n + 1)
    for more in ({}, {"hertz": Hertz((4e-3, 3e-3))}):
        even = pressed(flat, 1e-5, **more)
        assert pressed(flat, 1e-5, coupling=6e-3, **more) == pytest.approx(even, rel=1e-9)


@pytest.mark.parametrize("length", [2e-3, 8e-3, 0.03])
def test_a_punch_on_the_foundation_is_that_of_pasternak(length):
    """Over its width c at one end it bears k w (c + l tanh((b - c) / l)); at both sides twice."""
    b, w, n = SPUR.width, 1e-5, 600
    share = np.arange(n) / n
    for touching, sides in ((share < 0.2, (0.8,)), ((share >= 0.4) & (share < 0.6), (0.4, 0.4))):
        edge = sum(length * np.tanh(side * b / length) for side in sides)
        found = pressed(steps(touching), w, coupling=length)
        assert found == pytest.approx(w * (0.2 * b + edge), rel=5e-3)


def test_a_load_at_the_end_of_the_foundation():
    """k l w tanh(b / l), as slices become thin; slices that are not coupled carry none of it."""
    b, w, errors = SPUR.width, 1e-5, []
    wanted = 4e-3 * w * np.tanh(b / 4e-3)
    for n in (100, 200, 400):
        errors.append(pressed(steps(np.arange(n) < 1), w, coupling=4e-3) / wanted - 1)
    assert abs(errors[-1]) < 1.5e-2
    assert_allclose(np.array(errors[:-1]) / errors[1:], 2.0, rtol=0.1)
    alone = pressed(steps(np.arange(100) < 1), w)
    assert pressed(steps(np.arange(100) < 1), w, coupling=1e-7) == pytest.approx(alone)
    assert alone == pytest.approx(w * b / 100)


def test_slices_beside_a_ridge_lift_off():
    """What a foundation bears under a crowned flank, against its quadratic programme."""
    n, length, depth = 40, 6e-3, 1e-5
    z = (np.arange(n) + 0.5) / n - 0.5
    gap = 4e-5 * (2 * z) ** 2
    found = wheels(cells=n, correction=Correction(crowning=4e-5), coupling=length)
    phase = 0.5 * sum(SPUR.path) / SPUR.rb[0]
    load = load_at(found, (depth / SPUR.rb[0], 0.0), phase)
    k, h = K * SPUR.width / n, SPUR.width / n
    D = np.diff(np.eye(n), axis=0) * np.sqrt(k) * length / h
    A = np.vstack([np.sqrt(k) * np.eye(n), D])
    w = lsq_linear(A, np.zeros(len(A)), (depth - gap, np.full(n, 1.0)), tol=1e-15).x
    assert (w > depth - gap + 1e-9).sum() > 10
    assert load == pytest.approx((A.T @ A @ w).sum(), rel=1e-6)


def cut(**flanks):
    return lambda: wheels(correction=Correction(**flanks))


test_what_no_flank_is_like_is_refused = refused(
    (cut(maps=(np.zeros((25, 4, 3)), None)), r"\(25, 4, 3\).*or \(26"),
    (cut(maps=(None, np.zeros(4))), r"working flanks of the gear .*\(4,\)"),
    (cut(back_maps=(np.full((4, 3), np.nan), None)), "back flanks of the pinion .* 12 values"),
    (cut(pitch=(np.full(26, np.nan), ())), "is not finite"),
    (cut(run_out=((1e-3, 0.0), (0, 0))), "run-out 0.001 m of 'mesh'"),
    (lambda: wheels(coupling=1.0), "at least 0 and at most 0.03"),
    (lambda: wheels(conservative=True), "energy of mesh 'mesh' would jump"),
    (lambda: gear_mesh.Mesh(SPUR, K, Correction(maps=(np.eye(2), None))), "are for elements"),
    error=(rom.ConfigError, rom.ModelError),
)


def test_depths_of_teeth_are_those_of_the_compliance():
    _, hertz = bending_table(SPUR, n=3)
    middle = 0.5 * sum(SPUR.path)
    radius = float(np.hypot(SPUR.rb[0], middle))
    assert hertz.depths[1, 0] == pytest.approx(gear_mesh.tooth_compliance(SPUR, 0, radius)[2])


def stiffness_of(pair, phase, law):
    """Force along the line of action over the approach of the teeth and the face [N/m^2]."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    pinion = on_axle(mech, "pinion", inertia=(1e-3,) * 3)
    ends = pinion, mech.ground.marker((pair.distance, 0, 0))
    law = {"entry": 0.0, "conservative": False} | law
    mech.gear_mesh("mesh", *ends, axis=(0, 0, 1), pair=pair, phase=phase, **law)
    force = LOAD * pair.width
    mech.torque("load", pinion, (0, 0, force * pair.rb[0]))
    state = rom.equilibrium(mech)
    approach = pair.rb[0] * rom.mbs.snapshot(mech, state).joint("axle").angle[0]
    return force / approach / pair.width


def pair_of(degrees, width):
    return GearPair((50, 50), 3e-3, width, float(np.radians(degrees)))


@pytest.mark.parametrize("contact", ["linear", "hertz"])
def test_a_pair_of_teeth_softens_with_its_helix_as_in_iso_6336(contact):
    """c' is 14.1, 13.8 and 12.8 N/(mm um) at 0, 15 and 30 degrees; here spur teeth are the unit.

    The face is so narrow that one line bears over the whole of it at the pitch point.
    """
    found = []
    for degrees in (0, 15, 30):
        pair = pair_of(degrees, 4e-3)
        law = {"stiffness": gear_mesh.stiffness_table(pair, force=LOAD)}
        if contact == "hertz":
            law = dict(zip(("stiffness", "hertz"), bending_table(pair), strict=True))
        found.append(stiffness_of(pair, pair.pitch_point / pair.rb[0], law))
    wanted = np.array([14.1, 13.8, 12.8])
    assert 14.1 / found[0] * np.array(found) == pytest.approx(wanted, rel=0.04)
    assert found[0] > 1.01 * found[1] > 1.05 * found[2]


def test_the_mean_over_a_mesh_falls_with_the_helix_as_in_iso_6336():
    """c_gamma is 22.0, 20.7 and 16.8; lines that overlap by one pitch bear evenly all the time."""
    found = []
    for degrees in (0, 15, 30):
        pair = pair_of(degrees, 0.02)
        if degrees:
            pair = pair_of(degrees, float(pair.base_pitch / np.tan(pair.base_helix)))
        law = {"stiffness": gear_mesh.stiffness_table(pair, force=LOAD), "cells": 100}
        phases = pair.base_pitch / pair.rb[0] * (np.arange(8) + 0.37) / 8
        each = np.array([stiffness_of(pair, phase, law) for phase in phases])
        assert (np.ptp(each) < 1e-6 * each.mean()) == (degrees > 0)
        found.append(each.mean())
    assert 22.0 / found[0] * np.array(found) == pytest.approx([22.0, 20.7, 16.8], rel=0.02)
