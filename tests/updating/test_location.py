"""A wrong model is caught and what is wrong is named: joint, support, mass or sensor."""

import numpy as np
import pytest

import rom
from cases.solid import STEEL, composite
from rom.components.updating.family_model import family_model
from rom.components.updating.frf_data import estimators, noisy
from rom.components.updating.normal_equations import responses_at
from rom.updating import AddedMass, Channels, GroundSpring, Responses

REGIONS = ("inner", "middle", "outer")
PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in REGIONS}
PARAMETERS |= {f"rho_{name}": rom.Density(name, 0.4, 2.5) for name in REGIONS}
FREE = tuple(f"E_{name}" for name in REGIONS)
POINTS = [[x, 0.1, 0.08] for x in (0.33, 0.5, 0.67, 1.0)]
SENSORS = Channels(POINTS * 2, [[0, 1, 0]] * 4 + [[0, 0, 1]] * 4)
INPUTS = Channels([[1.0, 0.0, 0.0], [0.5, 0.1, 0.08]], [[0, 1, 1], [0, 1, -0.5]])
LINES = np.linspace(30, 700, 120)
HINGE = {"root": "x y z rx rz"}  # the clamp about y is a spring of the model
CLAMP = GroundSpring("root", (0, 0, 0, 0, 4e6, 0), 0.1, 10)
OFFERED = {
    "joint at the tip": GroundSpring("tip", (0, 0, 1e5), 0.1, 10),
    "twist at the tip": GroundSpring("tip", (0, 0, 0, 1e3, 0, 0), 0.1, 10),
    "turn at the root": GroundSpring("root", (0, 0, 0, 0, 4e6, 0), 0.1, 10),
    "mass at the tip": AddedMass("tip", 1.0, 0.1, 10),
}


@pytest.fixture(scope="module")
def family():
    where = dict(zip(range(6), np.repeat(REGIONS, 2), strict=True))
    model = composite(dict.fromkeys(REGIONS, STEEL), lambda c: where[c[0]], cells=(6, 1, 1))
    return rom.reduce_parametric(
        model, parameters=PARAMETERS, method=rom.CraigBampton(4),
        interfaces={"root": "rbe2", "tip": "rbe2"}, certify=False,
    )  # fmt: skip


def found(family, true, seed, on_force=0.0, **there):
    """Update of moduli alone, by a test of a structure that has more to it."""
    rows = (SENSORS.rows(family.body, "sensor"), INPUTS.rows(family.body, "input"))
    model = family_model(family, rows, {"clamp": CLAMP} | there, {}, HINGE)
    x = np.log([true.get(name, 1.0) for name in model.names])
    H = responses_at(model, x, np.array([0.02]), 2 * np.pi * LINES)
    rng = np.random.default_rng(seed)
    test = Responses(LINES, noisy(H, 0.03, rng), SENSORS, INPUTS, 1 / (1 + 100 * 0.03**2), 100)
    if on_force:
        test = averaged(H, on_force, rng)
    return rom.update(
        family, test, free=FREE, fixed=HINGE, attached={"clamp": CLAMP}, candidates=OFFERED,
        prior={"clamp": 1e-4}, damping=0.02,
    )  # fmt: skip


def averaged(H, on_force, rng, n=50):
    """H1 of noisy forces, and responses with ten per cent; its coherence is of the same records."""

    def gauss(shape):
        return rng.standard_normal((*shape, 2)) @ [1, 1j] / np.sqrt(2)

    f = gauss((n, LINES.size, 1, 2))
    x = H * (f + 0.1 * gauss((n, *H.shape)))
    f = f + on_force * gauss(f.shape)
    H1, _, _, coherence = estimators(x, np.broadcast_to(f, x.shape))
    return Responses(LINES, H1, SENSORS, INPUTS, coherence, n, force_noise=on_force, estimator="H1")


WRONG = [
    ({"joint": 0.3}, {"joint": OFFERED["joint at the tip"]}, "joint at the tip", 1),
    ({"clamp": 0.85}, {}, "turn at the root", -1),
    ({"rho_middle": 1.03}, {}, "rho_middle", 1),
    ({"mass": 0.15}, {"mass": OFFERED["mass at the tip"]}, "mass at the tip", 1),
]


@pytest.mark.parametrize("on_force", [0.1, 0.3])
@pytest.mark.parametrize(("true", "there", "name", "sign"), WRONG)
def test_what_is_wrong_is_named_where_forces_are_noisy(family, true, there, name, sign, on_force):
    """Noise that sensors share, as large as their own and three times: limits are wider then."""
    update = found(family, true, 1, on_force, **there)
    assert not update.verdict.ok
    assert max(update.scores, key=lambda k: abs(update.scores[k])) == name, update.scores
    assert sign * update.scores[name] > 6


@pytest.mark.parametrize("on_force", [0.1, 0.3])
def test_of_a_right_model_nothing_is_named_where_forces_are_noisy(family, on_force):
    update = found(family, {"E_middle": 1.1}, 1, on_force)
    assert update.verdict.ok, str(update.verdict)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("true", "there", "name", "sign"), WRONG)
def test_the_largest_score_is_that_of_what_is_wrong(family, true, there, name, sign, seed):
    """Of a joint, a support, the mass of a region and one that was added; of seven offered."""
    update = found(family, true, seed, **there)
    assert not update.verdict.ok
    assert max(update.scores, key=lambda k: abs(update.scores[k])) == name, update.scores
    assert sign * update.scores[name] > 10
    if name in ("joint at the tip", "turn at the root"):  # they bend along z
        assert np.argmax(update.by_sensor) >= 4
    assert any(f"largest score, {name}" in row.quantity for row in update.verdict.failures)


@pytest.mark.parametrize("seed", range(3))
def test_of_a_right_model_nothing_is_named(family, seed):
    update = found(family, {"E_middle": 1.1}, seed)
    assert update.verdict.ok, str(update.verdict)
    assert max(abs(score) for score in update.scores.values()) < 4
