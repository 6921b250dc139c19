"""Laws of the user: memory, C, outputs, wrong ones, and the check that finds what is wrong."""

import ctypes
import shutil
import subprocess
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit
from scipy.integrate import trapezoid

import rom
from cases.mbs.mechanisms import prepared, random_body, random_pose, random_state, simulate_quietly
from cases.mbs.parts import RECORD, on_guide, slipping
from cases.mbs.tangents import check_tangents
from cases.refusals import refused, refuses
from rom.errors import ConfigError, SolverError
from rom.mbs.elements import laws

STIFFNESS, YIELD, REACH = 1000.0, 20.0, 0.05
STARTS = {
    "equilibrium": rom.equilibrium,
    "motion": lambda mech: simulate_quietly(mech, t_end=0.1, dt=1e-3),
    "chosen steps": lambda mech: simulate_quietly(mech, t_end=0.1, dt=None),
}
ENERGY, LOSSES, OWN_MEMORY, BEYOND, COUNTS, NAN = range(1, 7)


def shaken(*, compiled=True, law=slipping, **options):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_guide(mech, "block")
    mech.drive("shake", "guide", lambda t: REACH * np.sin(2 * np.pi * t))
    more = {"parameters": (STIFFNESS, YIELD), "memory": [0.0]} | RECORD
    mech.law("damper", law, "ground", "block", compiled=compiled, **more | options)
    return mech


@pytest.mark.long
@pytest.mark.parametrize(
    ("compiled", "method"),
    [(True, "generalized-alpha"), (False, "generalized-alpha"), (True, "dop853")],
)
def test_what_slips_loses_the_area_of_its_loop(compiled, method):
    """4 F (X - F / k) in each cycle after the first quarter."""
    sol = simulate_quietly(shaken(compiled=compiled), t_end=2.25, dt=1.25e-3, method=method,
                           **({"rtol": 1e-6} if method == "dop853" else {}))  # fmt: skip
    loop = 4 * YIELD * (REACH - YIELD / STIFFNESS)
    work = sol.work[:, 0] + sol.work[:, 1]  # of the drive and, where the law is Python's, of it
    quarter = np.searchsorted(sol.t, 0.25 - 1e-9)
    lost = sol.energy.damping if compiled else -sol.energy.forces
    assert lost[-1] - lost[quarter] == pytest.approx(2 * loop, rel=2e-3)
    if compiled:
        assert work[-1] - work[quarter] == pytest.approx(2 * loop, rel=2e-3)


def test_its_record_has_forces_memory_and_outputs():
    sol = simulate_quietly(shaken(), t_end=1.0, dt=1e-3)
    said = sol.law("damper")
    x = sol.position("block")[:, 0]
    np.testing.assert_allclose(said.force[:, 1, 0], -STIFFNESS * (x - said.memory[:, 0]), atol=1e-8)
    assert np.abs(said.force[:, 0, 0]).max() == pytest.approx(YIELD)
    np.testing.assert_allclose(said.force[:, 0], -said.force[:, 1])
    np.testing.assert_allclose(said.energy, said.force[:, 0, 0] ** 2 / 2 / STIFFNESS)
    assert set(said.outputs) == {"slip"}
    np.testing.assert_allclose(said.outputs["slip"][1:], np.diff(said.memory[:, 0]), atol=1e-9)
    heat = trapezoid(said.lost, sol.t)
    assert heat == pytest.approx(sol.energy.damping[-1], rel=1e-2) and heat > 1.0
    refuses(ConfigError, r"no law 'x'; there are \['damper'\]", sol.law, "x")


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("dt", [1e-3, None])
def test_memory_goes_on_where_a_run_was_cut(compiled, dt):
    options = {"dt": dt} if dt else {"dt": None, "rtol": 1e-4}
    first = simulate_quietly(shaken(compiled=compiled), t_end=0.6, **options)
    rest = simulate_quietly(shaken(compiled=compiled), t_end=1.0, state=first.final, **options)
    whole = simulate_quietly(shaken(compiled=compiled), t_end=1.0, **options)
    slips = [sol.law("damper").memory[-1, 0] for sol in (rest, whole)]
    if dt:
        assert rest.final.base.tolist() == whole.final.base.tolist()
        np.testing.assert_array_equal(rest.q[-1], whole.q[-1])
    assert slips[0] == pytest.approx(slips[1], abs=1e-4) and abs(slips[0]) > 0.01


C_LAW = r"""
#include <math.h>
static double line(const double *x, double *gap) {
    double square = 0;
    for (int i = 0; i < 3; i++) { gap[i] = x[3 + i] - x[i]; square += gap[i] * gap[i]; }
    return sqrt(square);
}
void spring(double t, const double *p, const double *x, const double *memory, double *out) {
    double gap[3], length = line(x, gap);
    for (int i = 0; i < 3; i++) {
        double f = p[0] * (length - p[1]) * gap[i] / length;
        out[i] = f; out[3 + i] = -f;
    }
    out[12] = p[0] * (length - p[1]) * (length - p[1]) / 2;
    out[14] = length;
}
void slopes(double t, const double *p, const double *x, const double *memory, double *out) {
    double gap[3], length = line(x, gap);
    for (int i = 0; i < 3; i++) for (int j = 0; j < 3; j++) {
        double e = gap[i] * gap[j] / length / length;
        double k = p[0] * (e + (1 - p[1] / length) * ((i == j) - e));
        out[12 * i + j] = -k; out[12 * i + 6 + j] = SIGN k;
        out[12 * (6 + i) + j] = k; out[12 * (6 + i) + 6 + j] = -k;
    }
}
"""


def built(folder, sign="+"):
    if not shutil.which("cc"):
        pytest.skip("no compiler of C here")
    (folder / "law.c").write_text(C_LAW.replace("SIGN", sign))
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "law.c", "-o", "law.so", "-lm"], cwd=folder,
                   check=True)  # fmt: skip
    library = ctypes.CDLL(str(folder / "law.so"))
    return [
        SimpleNamespace(library=library, address=ctypes.cast(function, ctypes.c_void_p).value)
        for function in (library.spring, library.slopes)
    ]


def hung(add):
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bob = mech.add_rigid("bob", mass=1.0, inertia=(0.1, 0.1, 0.1), at=(0.5, 0, 0),
                         markers={"eye": (0, 0, 0.1)}, velocity=(0, 1, 0))  # fmt: skip
    add(mech, mech.ground.marker((0, 0, 0.3)), bob.marker("eye"))
    return mech


@pytest.mark.parametrize("slopes", [True, False])
def test_a_law_in_c_is_the_spring_of_the_package(tmp_path, slopes):
    entry, tangents = built(tmp_path)
    length = float(np.hypot(0.5, 0.2))
    more = {"tangents": tangents} if slopes else {}
    own = hung(lambda m, a, b: m.law("s", entry, a, b, parameters=(300.0, length), energy=True,
                                     outputs=["length"], **more))  # fmt: skip
    other = hung(lambda m, a, b: m.spring_damper("s", a, b, stiffness=300.0))
    a, b = (simulate_quietly(mech, t_end=0.5, dt=1e-3) for mech in (own, other))
    np.testing.assert_allclose(a.q, b.q, atol=1e-9)
    np.testing.assert_allclose(a.energy.strain, b.energy.strain, atol=1e-9)
    assert a.statistics["iterations"] <= 1.2 * b.statistics["iterations"]
    eye = a.position("bob", "eye") - (0, 0, 0.3)
    np.testing.assert_allclose(a.law("s").outputs["length"], np.linalg.norm(eye, axis=1))
    assert rom.check_law(own, "s").ok


def twisted(t, parameters, motion, memory, out):
    """Forces and moments on three markers by all of their motion, or by places and axes alone."""
    for k in range(3):
        j, moving = (k + 1) % 3, parameters[0]
        gap, axis = motion.position[j] - motion.position[k], motion.axes[k, :, 0]
        out.force[k] = 3.0 * gap + 0.7 * np.cross(axis, motion.axes[j, :, 1])
        out.force[k] += moving * (0.2 * motion.velocity[j] + 0.1 * np.cross(axis, motion.omega[k]))
        out.moment[k] = np.cross(gap, axis) * np.sum(gap**2) - moving * 0.3 * motion.omega[j]
        out.moment[k, 2] += moving * 0.4 * motion.velocity[k, 0] * motion.position[j, 1]


@pytest.mark.parametrize("moving", [1.0, 0.0])
def test_differences_are_the_tangents_of_any_law(moving):
    rng = np.random.default_rng(5)
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    soft = mech.add_flexible("soft", random_body(rng), **random_pose(rng))
    hard = mech.add_rigid("hard", mass=1.0, inertia=(0.1, 0.2, 0.2), **random_pose(rng))
    markers = soft.marker(soft.names[0]), hard.marker((0.1, 0.2, 0)), mech.ground.marker((0, 0, 1))
    mech.law("law", twisted, *markers, parameters=[moving], compiled=True, energy=True)
    packed, W = prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    q, v, a, lam = random_state(rng, packed)
    if moving:  # the change of velocities with the position is left out
        v[:] = 0.0
    check_tangents(packed, W, (q, v, a, lam), np.eye(v.size), 1e-6)


def late_nan(t, parameters, motion, memory, out):
    out.force[1, 0] = -10.0 * motion.position[1, 0]
    if t > 0.0505:
        out.force[1, 0] = np.sqrt(-t)


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("method", ["generalized-alpha", "bdf", "dop853"])
def test_a_law_that_stops_to_be_a_number_is_named_and_the_motion_kept(compiled, method):
    mech = hung(lambda m, a, b: m.law("bad spring", late_nan, a, b, compiled=compiled))
    with np.errstate(invalid="ignore"), pytest.raises(SolverError, match="'bad spring'") as told:
        simulate_quietly(mech, t_end=0.1, dt=1e-3, method=method)
    assert "t = 0.05" in str(told.value)
    assert told.value.solution.t[-1] >= (0.01 if method == "dop853" else 0.04)


@pytest.mark.parametrize("start", STARTS)
def test_a_law_that_never_is_a_number_is_named_at_once(start):
    mech = hung(lambda m, a, b: m.law("hole", spoiled, a, b, parameters=[NAN], compiled=True))
    refuses(SolverError, "the law of 'hole' gives no finite number", STARTS[start], mech)


def unknown_name(t, parameters, motion, memory, out):
    out.force[0, 0] = nobody(t)  # noqa: F821


REFUSED = [
    (lambda m, a, b: m.law("l", late_nan), "needs a marker"),
    (lambda m, a, b: m.law("l", None, a), "function = None of 'l' must be a function"),
    (lambda m, a, b: m.law("l", late_nan, a, tangents=3), "tangents = 3 of 'l' must be a function"),
    (lambda m, a, b: m.law("l", unknown_name, a, compiled=True), "compiled: NameError: .*'nobody'"),
    (lambda m, a, b: m.law("l", late_nan, rom.mbs.Marker("nobody", (0.0, 0.0, 0.0))), "nobody"),
    (lambda m, a, b: m.add("l", 3, laws.LAWS_FAMILY), "element = 3 of 'l' must be of type Law"),
]


test_wrong_laws_are_refused_by_name = refused(
    *((partial(hung, add), words) for add, words in REFUSED), error=ConfigError
)


@njit
def pulling(t, parameters, motion, memory, out):
    gap = motion.position[1] - motion.position[0]
    slide = motion.velocity[1] - motion.velocity[0]
    out.force[0] = 5.0 * gap + 2.0 * slide
    out.force[1] = -out.force[0]
    out.energy[0] = 2.5 * np.sum(gap**2)
    out.lost[0] = 2.0 * np.sum(slide**2)


@njit
def pulling_slopes(t, parameters, motion, memory, K, C):
    for i in range(3):
        for a in range(2):
            for b in range(2):
                sign = -1.0 if a == b else 1.0
                K[6 * a + i, 6 * b + i] = sign * 5.0
                C[6 * a + i, 6 * b + i] = sign * 2.0


def wrong_slopes(t, parameters, motion, memory, K, C):
    pulling_slopes(t, parameters, motion, memory, K, C)
    K[7, 1] *= 1.001


def spoiled(t, parameters, motion, memory, out):
    """The same law with one mistake."""
    pulling(t, parameters, motion, memory, out)
    if parameters[0] == ENERGY:
        out.energy[0] *= 2.0
    elif parameters[0] == LOSSES:
        out.lost[0] = -out.lost[0]
    elif parameters[0] == OWN_MEMORY:
        memory[0] = 1.0
    elif parameters[0] == BEYOND:
        for k in range(5):
            out.outputs[k] = 1.0
    elif parameters[0] == COUNTS:
        out.memory[0] = memory[0] + 1.0
    elif parameters[0] == NAN:
        out.moment[1, 2] = np.nan


FOUND = {
    0: "error of the stiffness / largest: force on marker 1, y",
    ENERGY: "power + stored + lost / largest",
    LOSSES: "power + stored + lost / largest",
    OWN_MEMORY: "numbers written where none may be",
    BEYOND: "numbers written where none may be",
    COUNTS: "answers that change when it finds its own memory: memory 0",
    NAN: "numbers that are not finite: moment on marker 1, z",
}


@pytest.mark.once
@pytest.mark.parametrize("mistake", FOUND)
def test_the_check_names_what_is_wrong(mistake):
    slopes = None if mistake else wrong_slopes
    more = {"parameters": [mistake], "memory": [0.0], "tangents": slopes}
    mech = hung(lambda m, a, b: m.law("l", spoiled, a, b, energy=True, compiled=True, **more))
    report = rom.check_law(mech, "l")
    assert not report.ok and report.failures[0].quantity.startswith(FOUND[mistake]), str(report)


def test_the_check_finds_nothing_in_a_right_law():
    mech = hung(lambda m, a, b: m.law("l", pulling, a, b, tangents=pulling_slopes, energy=True))
    assert rom.check_law(mech, "l").ok
    assert rom.check_law(mech, "l", samples=2, rng=np.random.default_rng(3)).ok
    refuses(ConfigError, "name = 'x': no law", rom.check_law, mech, "x")


def test_the_check_finds_a_wrong_sign_in_c(tmp_path):
    entry, tangents = built(tmp_path, sign="-")
    mech = hung(lambda m, a, b: m.law("s", entry, a, b, parameters=(300.0, 0.4), energy=True,
                                      outputs=["length"], tangents=tangents))  # fmt: skip
    assert not rom.check_law(mech, "s").ok
