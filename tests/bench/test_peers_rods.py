"""What the comparison of rods with other programs hands over, and its figures."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks.peers import compare, rods
from rom import rotation
from rom.components.cosserat import body, straight
from rom.components.wind.wind_turbine import RATED_SPEED, blade, ramp, run_up


def test_beams_have_the_sections_of_the_blade():
    one = blade(48, azimuth=2.0)
    described = {name: np.array(value) for name, value in rods.beams(one).items()}
    assert_allclose(described["mass"] @ described["length"], one.mass.sum(), rtol=1e-12)
    lumped = np.zeros(49)
    lumped[:-1] += described["mass"] * one.h / 2
    lumped[1:] += described["mass"] * one.h / 2
    assert_allclose(lumped, one.mass, rtol=1e-12)
    # along: EA, two shear rigidities, GJ, bending about first and second axis of a section
    assert_allclose(described["stiffness"][:, :3], one.stretch[:, [2, 0, 1]])
    around = (described["stiffness"][24:40, 3:] + described["stiffness"][25:41, 3:]) / 2
    assert_allclose(around, one.bend[25:41][:, [2, 0, 1]], rtol=0.06)
    damped = blade(48, damped=True)
    ratio = described["damping"] / described["stiffness"]
    seen = damped.viscous_stretch / damped.stretch, damped.viscous_bend[1:] / damped.bend[1:]
    assert_allclose(ratio[:, :3], seen[0][:, [2, 0, 1]])
    assert_allclose(ratio[:, 3:], seen[1][:, [2, 0, 1]])
    assert_allclose(described["inertia"][:, 0], described["inertia"][:, 1:].sum(axis=1))
    for k, node in enumerate(described["nodes"]):
        A = rotation.matrix(node[3:])
        assert_allclose(A[:, 0], one.x[-1] / np.linalg.norm(one.x[-1]), atol=1e-12)
        assert_allclose(node[:3], one.x[k])
        before, after = (rotation.matrix(one.p[j])[:, 0] for j in (k, k + 1))
        between = before + after
        assert_allclose(A[:, 1], between / np.linalg.norm(between), atol=2e-2)


@pytest.mark.long
@pytest.mark.once
def test_the_rotor_here_is_the_run_up_of_its_blades(monkeypatch):
    monkeypatch.setattr(rods, "RISE_TIME", 4.0)
    seconds, tip = rods.by_rom(8)
    one = blade(8, damped=True)
    one = one._replace(inertia=body(one).frames.inertia)  # plates have some in a mechanism
    alone = run_up(one, t_end=4.0, dt=rods.TIME_STEP, rise=4.0)
    assert seconds > 0
    every = round(4.0 / rods.TIME_STEP) // rods.N_SAMPLES
    assert_allclose(tip[:, 0], alone.tip[::every, 0], atol=1e-5)
    assert_allclose(tip[:, 1], alone.tip[::every, 1], atol=1e-5)
    assert np.abs(tip[:, 1]).max() > 0.03


def test_both_programs_turn_the_hub_alike():
    """The script knows nothing of rom; its law of the angle is read from its text."""
    source = Path(rods.SCRIPT_FILE).read_text()
    law = next(f for f in ast.parse(source).body if getattr(f, "name", "") == "angle")
    scope = {"sin": np.sin, "pi": np.pi}
    exec(compile(ast.Module([law], []), "beams", "exec"), scope)
    for t in (0.3, 7.0, 19.9, 25.0):
        assert_allclose(
            scope["angle"](t, RATED_SPEED, 20.0), ramp(RATED_SPEED, 20.0)[1](t), rtol=1e-14
        )


def test_the_cantilever_is_the_elastica_and_the_one_handed_over(monkeypatch):
    """Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145: P L^2 / EI = 2, less what shear adds."""
    ours = rods.bent_by_rom(100)
    assert_allclose(ours["tip"], (1 - 0.16064, 0.0, -0.49346), atol=3e-4)
    twist = np.sqrt(100.0 / 1e-3) / 4  # Hz, a bar clamped at one end
    assert np.abs(ours["frequencies"] / twist - 1).min() < 1e-3
    monkeypatch.setattr(compare, "interpreter", lambda: "python")
    monkeypatch.setattr(
        compare, "answer_of", lambda command: json.loads(Path(command[2]).read_text())
    )
    given = rods.bent_by_exudyn(100)
    one = straight(1.0, 100, **rods.CANTILEVER_SECTION)
    assert_allclose(given["stiffness"], np.concatenate([one.stretch[50], one.bend[50]]))
    assert_allclose(given["inertia"], one.inertia[50] * 100)
    assert_allclose((given["mass"], given["length"]), (one.mass.sum(), one.h.sum()))
    assert given["force"] == [0.0, 0.0, -200.0]
