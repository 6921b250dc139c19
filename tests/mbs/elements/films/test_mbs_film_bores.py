"""Oil films that bend their bores: limits, tangents, energy, an elastic film of another program."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.films import ORIGIN, held_rotor
from cases.mbs.mechanisms import prepared, residual_at, tangents_at
from cases.mbs.tangents import shifted
from cases.mbs.tubes import tube
from rom.mbs import Groove, JournalBearing
from rom.mbs.elements.films.journals import FIRST_CONTENT, KNOWN, TIME

DIAMETER, LENGTH, CLEARANCE, OUTER = 0.04, 0.04, 4e-5, 0.03
SOFT, STEEL = 5e9, 2e11  # moduli [Pa]
SPEED, OIL, LOAD = 300.0, 0.02, (0.0, -2000.0)
CELLS = (24, 2, 6)  # of the bush; its bore ends a cell before the ends
NONE = np.zeros(0)


def bearing(cells=(60, 8), grooves=(), **more):
    return JournalBearing(DIAMETER, LENGTH, CLEARANCE, grooves, cells=cells, **more)


@cache
def ring(E=SOFT, cells=CELLS):
    """A bush of this modulus."""
    material = rom.Material(E=E, nu=0.3, rho=2000.0)
    return tube(DIAMETER / 2, OUTER, 1.5 * LENGTH, cells, material)


@cache
def bush(functions, E=SOFT, cells=CELLS, reference="rim"):
    """The same reduced; its rim is rigid."""
    return rom.reduce(ring(E, cells), method=rom.Guyan(), certify=False, reference=reference,
                      interfaces={"bore": functions, "rim": "rbe2"})  # fmt: skip


def at_rest(body, b=None, **more):
    """What the film is like in which a loaded rotor rests."""
    mech = held_rotor(b or bearing(), LOAD, speed=SPEED, oil=OIL, body=body, **more)
    state = rom.equilibrium(mech, spin={"turn": SPEED})
    return mech, state, rom.mbs.snapshot(mech, state).journal_bearing("film")


# --- tangents and energy ---


def pair(law, reference="mean-axis"):
    """A journal in a soft bush, both anywhere; coordinates and velocities."""
    mech = rom.Mechanism(gravity=ORIGIN)
    own = {"mass": 0.2, "inertia": (1e-4, 2e-4, 3e-4)}
    turned = np.array([0.8, 0.3, -0.4, 0.33])
    at = {"at": (0.3, -0.2, 0.1), "orientation": turned / np.linalg.norm(turned)}
    part = mech.add_flexible("bush", bush(rom.FourierLegendre(3, 2), SOFT, (16, 1, 6), reference),
                             **at)  # fmt: skip
    journal = mech.add_rigid("journal", **own, **at)
    axis, across = rom.rotation.matrix(at["orientation"]).T[[2, 0]]
    mech.journal_bearing("film", journal.marker(ORIGIN), part.marker("bore"), axis=axis,
                         reference=across, oil=OIL, elastic_bush=True, bearing=bearing(
                             (30, 6), [Groove(1.2, 0.3, 1e5, share=0.7)], cavitation=law))  # fmt: skip
    packed, W = prepared(mech)
    rng, r = np.random.default_rng(3), packed.system.bodies.r[0]
    film = mech.journal_bearings["film"]
    delta, v = 1e-5 * rng.normal(size=packed.v.size), rng.normal(size=packed.v.size)
    opened = np.abs(film.bore[0] @ film.bore[1]).max(axis=0)
    scale = 1.0 / np.maximum(opened, 0.1 * opened.max())
    delta[6 : 6 + r] = 2e-6 * scale * rng.normal(size=r)
    v *= 1e-3
    v[6 : 6 + r] = 3e-4 * scale * rng.normal(size=r)
    v[-1] = SPEED
    return packed, W, shifted(packed, packed.q, delta), v, np.concatenate(
        [np.full(6, 1.0), scale, np.full(6, 1.0)])  # fmt: skip


@pytest.mark.parametrize(("law", "passed"), [("none", 0.0), ("reynolds", 0.0), ("jfo", 0.0),
                                             ("jfo", 1e-3)])  # fmt: skip
def test_tangents_are_the_derivatives(law, passed):
    """Forces on bodies and bore by motions and bending, of both signs and all of their products."""
    packed, W, q, v, scale = pair(law)
    first = len(packed.places.coordinates)

    def force(dq, dv):
        residual_at(packed.system, W, shifted(packed, q, dq), v + dv, 0 * v, NONE)
        return W.residual.copy()

    force(0 * v, 0 * v)
    W.base[first:] = W.fresh
    W.base[first + KNOWN], W.base[first + TIME] = float(passed > 0.0), -passed
    W.base[first + FIRST_CONTENT :] *= 0.97
    step, none, faster = 1e-9 * scale, 0 * v, 3e4 if passed else 100.0  # no void closes
    stiff = np.array([(force(e, none) - force(-e, none)) / 2 for e in np.diag(step)]).T
    loss = np.array([(force(none, e) - force(none, -e)) / 2 for e in np.diag(faster * step)]).T
    for found, weights in ((stiff, (0.0, 0.0, 1.0)), (loss, (0.0, 1.0, 0.0))):
        tangents_at(packed.system, W, q, v, none, NONE, weights)
        known = W.Kt * step if weights[2] else W.S * faster * step
        for columns in (slice(0, 6), slice(6, -6), slice(-6, None)):
            size = np.abs(found[:, columns]).max(axis=1, keepdims=True)
            floor = 1e-3 * size[[0, 1, 2, -6, -5, -4]].max()
            assert_allclose(known[:, columns] / np.maximum(size, floor),
                            found[:, columns] / np.maximum(size, floor), atol=2e-4)  # fmt: skip


def test_a_free_pair_keeps_momentum_and_energy():
    """What the film takes is heat; what it gives to the bore is in the bore."""
    mech = rom.Mechanism(gravity=ORIGIN)
    body = bush(rom.FourierLegendre(2, 1), SOFT, (16, 1, 6), "mean-axis")
    part = mech.add_flexible("bush", body, at=ORIGIN, omega=(0, 0, -20.0), velocity=(0.4, 0, 0))
    journal = mech.add_rigid("journal", mass=0.3, inertia=(1e-4, 1e-4, 2e-4), at=(1e-5, 2e-5, 0),
                             omega=(0, 0, 300.0), velocity=(0.4, 0.01, 0))  # fmt: skip
    mech.journal_bearing("film", journal.marker(ORIGIN), part.marker("bore"), axis=(0, 0, 1),
                         bearing=bearing((30, 4)), oil=OIL, elastic_bush=True)  # fmt: skip
    sol = rom.simulate(mech, t_end=2e-3, dt=2e-6, method="bdf", save_every=20, progress=False)
    p, L = sol.momentum
    assert_allclose(p, np.tile(p[0], (len(p), 1)), atol=1e-9 * np.abs(p[0]).max())
    assert_allclose(L, np.tile(L[0], (len(L), 1)), atol=1e-6 * np.abs(L[0]).max())
    assert sol.energy.damping[-1] > 0.1
    assert rom.audit(sol).ok
