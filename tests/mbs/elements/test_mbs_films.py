"""Oil films between bodies: in the frame of the bush, with momentum, power and tangents."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import prepared, residual_at, tangents_at
from cases.mbs.tangents import difference, shifted
from rom.mbs import Groove, JournalBearing
from rom.rotation import matrix

ORIGIN, NONE, UPRIGHT = (0.0, 0.0, 0.0), np.zeros(0), np.eye(3)
GROOVES = [Groove(1.2, 0.3, 1e5, share=0.7)]
VISCOSITY, SPEED = 0.03, 100.0
MOTION = np.array([0.4e-4, 0.3e-4, 1e-4, -2e-4])
RATE = np.array([5e-4, 2e-4, -0.3e-2, 0.4e-2])


def bearing(law="reynolds", cells=(60, 8), grooves=GROOVES, **more):
    return JournalBearing(0.1, 0.1, 1e-4, grooves, cells=cells, cavitation=law, **more)


def turned_by(vector):
    """(3, 3) rotation by a vector."""
    angle = np.linalg.norm(vector)
    axis = vector / angle if angle else np.array([0.0, 0.0, 1.0])
    return matrix([np.cos(angle / 2), *np.sin(angle / 2) * axis])


def tilt(motion):
    """Rotation of a journal that makes its axis (a, b, 1) in the bush."""
    n = np.array([motion[3], -motion[2], 1.0])
    n /= np.linalg.norm(n)
    v = np.cross([0, 0, 1], n)
    size = np.linalg.norm(v)
    return turned_by(np.arcsin(size) * v / size if size else v)


def two_bodies(b, A=UPRIGHT, at=ORIGIN, motion=MOTION, **more):
    """Journal and bush free in space, the bush turned by A, the journal in it as `motion` says."""
    mech = rom.Mechanism(gravity=ORIGIN)
    own = {"mass": 2.0, "inertia": (0.01, 0.02, 0.03)}
    x, y = A[:, 0], A[:, 1]
    place = np.asarray(at) + motion[0] * x + motion[1] * y
    journal = mech.add_rigid("journal", at=place, orientation=A, **own)
    bush = mech.add_rigid("bush", at=at, orientation=A, **own)
    given = {"axis": A[:, 2], "reference": x, "bearing": b, "oil": VISCOSITY}
    mech.journal_bearing("film", journal.marker(ORIGIN), bush.marker(ORIGIN), **given | more)
    return mech


def moved(packed, A, motion=MOTION):
    """Coordinates of the same with the journal tilted."""
    delta = np.zeros(12)
    angle = tilt(motion)
    vector = np.array([angle[2, 1] - angle[1, 2], angle[0, 2] - angle[2, 0],
                       angle[1, 0] - angle[0, 1]]) / 2  # fmt: skip
    size = np.linalg.norm(vector)
    delta[3:6] = vector * (np.arcsin(size) / size if size else 1.0)  # in its own axes
    return shifted(packed, packed.q, delta)


def velocities(A, rate=RATE, spin=SPEED, motion=MOTION):
    """(12,) of the journal with these rates in a bush at rest."""
    n = tilt(motion) @ [0, 0, 1.0]
    dn = np.array([rate[3], -rate[2], 0.0])  # of (a, b, 1)
    dn = (dn - (dn @ n) * n) / np.linalg.norm([motion[3], -motion[2], 1.0])
    omega = np.cross(n, dn)
    omega += (spin - omega[2]) / n[2] * n
    v = np.zeros(12)
    v[:3] = A @ [rate[0], rate[1], 0.0]
    v[3:6] = tilt(motion).T @ omega
    return v


def loads(packed, W, q, v):
    """(2, 6) forces and moments on journal and bush, world, and the power lost."""
    residual_at(packed.system, W, q, v, 0 * v, NONE)
    table = next(iter(packed.elements.values()))
    return W.wrench[[table.i[0], table.j[0]]].copy(), W.power[2]


@pytest.mark.parametrize("law", ["none", "reynolds", "jfo"])
@pytest.mark.parametrize("spin", [SPEED, -SPEED])
def test_tangents_are_the_derivatives(law, spin):
    """Of positions and velocities, for a bush that moves and turns, too."""
    rng = np.random.default_rng(3)
    A = turned_by(rng.normal(size=3))
    packed, W = prepared(two_bodies(bearing(law), A, (0.3, -0.2, 0.1)))
    q = moved(packed, A)
    v = velocities(A, spin=spin)
    v[6:] = 0.02 * rng.normal(size=6)
    v[:3] += v[6:9]
    v[3:6] += v[9:]

    def force(dq, dv):
        residual_at(packed.system, W, shifted(packed, q, dq), v + dv, 0 * v, NONE)
        return W.residual.copy()

    scale = np.tile([1e-10, 1e-10, 1e-10, 1e-9, 1e-9, 1e-9], 2)
    stiff = difference(lambda x: force(x * scale * 1e6, 0 * v), 12) / scale / 1e6
    loss = difference(lambda x: force(0 * v, x), 12, 1e-8)
    tangents_at(packed.system, W, q, v, 0 * v, NONE, (0.0, 0.0, 1.0))
    size = np.abs(stiff).max(axis=1, keepdims=True)
    assert np.abs((W.Kt - stiff) / size).max() < 1e-5
    tangents_at(packed.system, W, q, v, 0 * v, NONE, (0.0, 1.0, 0.0))
    assert_allclose(W.S, loss, atol=1e-6 * np.abs(loss).max())
