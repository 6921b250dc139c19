"""Linear equations for people of control: closed forms, and the frequency response of a beam."""

import numpy as np
import pytest
from scipy.signal import StateSpace

import rom
from cases.solid import block, reduced

KP, KD, M, G, L = 40.0, 6.0, 2.0, 9.81, 0.5


def responses(matrices, f):
    """(f, outputs, inputs) at frequencies [Hz]."""
    A, B, C, D = matrices
    return np.array([C @ np.linalg.solve(2j * np.pi * x * np.eye(len(A)) - A, B) + D for x in f])


def arm():
    """A rigid link with its mass at the tip, upright, held by a controller at its shoulder."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    mech.add_rigid(
        "arm",
        mass=M,
        inertia=(1e-9,) * 3,
        at=(0, 0, L),
        markers={"pin": (0, 0, -L), "mid": (0, 0, 0)},
    )
    mech.revolute("shoulder", "ground", "arm.pin", axis=(0, 1, 0))
    mech.rotational_spring("controller", "shoulder", stiffness=KP, damping=KD)
    return mech


def test_an_arm_upright_has_the_poles_and_the_gain_of_its_formula():
    """m l^2 phi'' + KD phi' + (KP - m g l) phi = M_y: gravity takes stiffness."""
    names = ["arm.pin ry"], ["arm.pin ry", "arm.mid x", "arm.pin ry rate"]
    A, B, C, D = rom.linearize(arm()).to_statespace(*names)
    inertia, stiffness = M * L * L, KP - M * G * L
    expected = np.sort_complex(np.roots([inertia, KD, stiffness]))
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(A)), expected, rtol=1e-6)
    gain = -C @ np.linalg.solve(A, B) + D
    np.testing.assert_allclose(gain[:, 0], [1 / stiffness, L / stiffness, 0], rtol=1e-6, atol=1e-12)
    poles = np.sort_complex(StateSpace(A, B, C[:1], D[:1]).poles)
    np.testing.assert_allclose(poles, expected, rtol=1e-6)


def test_a_beam_answers_as_its_frequency_response():
    body = reduced(6, block(), reference="root", damping=rom.ModalDamping(0.02, fixed=("root",)))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("beam", body)
    mech.fixed("wall", mech.ground.marker(tuple(body.marker("root").point)), "beam.root")
    around, f = rom.linearize(mech), np.array([3.0, 40.0, 211.0])
    found = responses(around.to_statespace(["beam.tip z"], ["beam.tip z", "beam.tip ry rate"]), f)
    how = {"force": "beam.tip", "motion": "beam.tip"}
    other = rom.frequency_response(mech, None, f, **how).receptance
    scale = np.abs(other).max()
    np.testing.assert_allclose(found[:, 0, 0], other[:, 2, 2], atol=1e-9 * scale)
    rate = 2j * np.pi * f * other[:, 4, 2]
    np.testing.assert_allclose(found[:, 1, 0], rate, atol=1e-9 * np.abs(rate).max())


@pytest.mark.parametrize("name", ["arm.tip x", "arm.pin q", "arm.pin", "leg x"])
def test_what_is_no_marker_or_no_axis_is_told(name):
    with pytest.raises(rom.ConfigError, match=r"arm\.pin|'rx'"):
        rom.linearize(arm()).to_statespace([name], ["arm.pin ry"])
