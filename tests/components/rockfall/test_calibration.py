"""Parameters from histories, what a gallery bears, and what is published of tests."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refused
from rom.components import rockfall
from rom.components.rockfall import Cushion, Gallery, History, Shear, Slab, calibrate, strike
from rom.components.rockfall.calibration import CHANNELS, FIVE_PARAMETERS
from rom.errors import ConfigError, ModelError

FIRST = Gallery(4000.0, 15.0, 2500.0, Cushion.of_sand(4000.0, 1e6, recovery=0.1), Shear(2e9),
                Slab.of_mass(6000.0, 1.2e8))  # fmt: skip
TRUE = dict(zip(FIVE_PARAMETERS, (1.4, 0.6, 1.3, 0.8, 1.5), strict=True))
SENSORS = ("acceleration of the boulder", "force in bending", "deflection")


def histories(noise, seed=0, sensors=SENSORS):
    """What sensors of 5 kHz see, with noise by a share of the largest value."""
    true, rng = rockfall.scaled(FIRST, TRUE), np.random.default_rng(seed)
    got, t = strike(true, t_end=0.2, keep=20_000), np.arange(0, 0.2, 2e-4)
    values = {c: np.interp(t, got.t, CHANNELS[c](true, got)) for c in sensors}
    sizes = {c: noise * np.abs(x).max() for c, x in values.items()}
    return {c: History(t, x + sizes[c] * rng.standard_normal(t.size)) for c, x in values.items()}


def test_five_parameters_come_back_from_what_they_moved():
    found = calibrate(FIRST, histories(1e-6))
    assert_allclose([found.factors[n] for n in TRUE], list(TRUE.values()), rtol=2e-3)
    assert max(found.residuals.values()) < 1e-3
    assert found.gallery.plug == pytest.approx(1.3 * 2500.0, rel=2e-3)
    assert found.gallery.cushion.stiffness == pytest.approx(1.4 * FIRST.cushion.stiffness, rel=1e-3)


def test_noise_leaves_the_uncertainty_that_is_reported():
    """Scatter over twelve sets of noise, and the chance of chi squared with 60 degrees."""
    found = [calibrate(FIRST, histories(0.05, seed)) for seed in range(12)]
    misses = np.array([[np.log(f.factors[n] / TRUE[n]) / f.deviations[n] for n in TRUE]
                       for f in found])  # fmt: skip
    assert 0.5 < (misses**2).mean() < 1.7  # 60 squares: 1 within 0.18 (standard deviation)
    assert np.abs(misses).max() < 4.0
    assert all(f.residuals["deflection"] == pytest.approx(0.05, rel=0.15) for f in found)
    twice = calibrate(FIRST, histories(0.10))
    ratio = [twice.deviations[n] / found[0].deviations[n] for n in TRUE]
    assert_allclose(ratio, 2.0, rtol=0.2)


def test_a_given_deviation_is_the_weight():
    quiet = {c: replace(h, deviation=0.02 * np.abs(h.values).max())
             for c, h in histories(0.02).items()}  # fmt: skip
    loud = {c: replace(h, deviation=2 * h.deviation) for c, h in quiet.items()}
    one, two = (calibrate(FIRST, m) for m in (quiet, loud))
    assert_allclose([two.deviations[n] / one.deviations[n] for n in TRUE], 2.0, rtol=1e-3)
    assert_allclose(np.diag(one.correlation), 1.0)


def test_a_channel_may_come_in_pieces_and_be_cut():
    whole = histories(1e-6)
    h = whole["deflection"]
    parts = [History(h.t[:400], h.values[:400]), History(h.t[700:], h.values[700:])]
    found = calibrate(FIRST, whole | {"deflection": parts}, t_end=0.18)
    assert_allclose([found.factors[n] for n in TRUE], list(TRUE.values()), rtol=2e-3)


def test_a_sensor_in_the_boulder_reads_what_stops_it_and_its_weight():
    got = strike(FIRST, t_end=0.1, keep=10**4)
    stops = 9.81 - np.gradient(got.v[:, 0], got.t)
    read = CHANNELS["acceleration of the boulder"](FIRST, got)
    assert_allclose(read, stops, atol=0.01 * read.max())
    sunk = CHANNELS["penetration"](FIRST, got)
    assert sunk.max() == pytest.approx(got.deepest, rel=1e-6)
    assert CHANNELS["deflection"](FIRST, got).max() == pytest.approx(got.deflection, rel=1e-3)
    for k, name in enumerate(("force in the cushion", "force in shear", "force in bending")):
        assert CHANNELS[name](FIRST, got).max() == pytest.approx(got.peaks[k], rel=1e-3)


def elastic():
    """The fit of an elastic cushion runs to the bound of what can be given back."""
    got = strike(replace(FIRST, cushion=replace(FIRST.cushion, recovery=1.0)), t_end=0.2)
    return {"force in the cushion": History(got.t, got.forces[:, 0])}


T = np.linspace(0, 0.1, 50)
UNDAMPED = replace(FIRST, slab=Slab.of_mass(6e3, 1.2e8, damping=0.0))
GAP = np.r_[T[:20], T[30:]]

test_bad_histories_are_named = refused(
    (lambda: History(GAP, np.sin(GAP)), r"gap from 0.0387\d+ s to 0.0612\d+ s"),
    (lambda: History(T, np.where(T == T[7], np.nan, 1.0)), "value 7 is"),
    (lambda: History(T[::-1], T), "times must grow"),
    (lambda: History(T - 0.01, T), "t >= 0"),
    (lambda: History(T[:5], T[:5]), "8 values or more"),
    (lambda: History(T, 0 * T), "history needs values"),
    (lambda: History(T, T, deviation=-1.0), "a positive deviation"),
    (lambda: calibrate(FIRST, {}), "nothing is measured"),
    (lambda: rockfall.capacity_heights(FIRST, [1.0]), "bears anything"),
    (lambda: calibrate(FIRST, {"hue": History(T, T)}), "'hue' is no channel"),
    (lambda: calibrate(FIRST, histories(0.01), ["luck"]), "'luck' cannot be"),
    (lambda: calibrate(FIRST, histories(0.01), ["mass of the plug"] * 2), "each once"),
    (lambda: calibrate(FIRST, histories(0.01), []), "at least one"),
    (lambda: calibrate(UNDAMPED, histories(0.01), ["damping of the slab"]), ModelError,
     "do not determine damping of the slab"),
    (lambda: calibrate(FIRST, elastic(), ["stiffness of the cushion", "recovery of the cushion"]),
     ModelError, "do not determine recovery of the cushion"),
    (lambda: calibrate(FIRST, histories(0.01, sensors=("force in the cushion",)), t_end=0.004),
     ModelError, "do not determine recovery of the cushion"),
    error=ConfigError,
)  # fmt: skip

BOUNDED = replace(FIRST, shear=replace(FIRST.shear, capacity=1.5e6),
                  slab=replace(FIRST.slab, capacity=2e6))  # fmt: skip


def test_shares_are_those_of_the_impact():
    verdict = rockfall.design_check(BOUNDED)
    got = strike(replace(BOUNDED, shear=FIRST.shear))  # what would have to be carried
    assert verdict.shear == pytest.approx(got.peaks[1] / 1.5e6)
    assert verdict.bending == pytest.approx(got.deflection / (2e6 / 1.2e8))
    assert verdict.cushion == 0.0
    assert verdict.share == verdict.bending > verdict.shear > 1  # by the second blow
    assert verdict.decides == "bending"
    assert verdict.state == "cracked"
    brittle = replace(BOUNDED, shear=replace(BOUNDED.shear, capacity=2e5, ultimate=0.01))
    assert rockfall.design_check(brittle).share == pytest.approx(7.5 * verdict.shear)
    assert rockfall.design_check(brittle).state == "punched"
    twice = rockfall.design_check(BOUNDED, ductility=2.0)
    assert twice.bending == pytest.approx(verdict.bending / 2)


def test_a_gallery_bears_heights_as_hertz_says():
    """Of rigid ground under Hertz the force goes by m^(2/3) H^(3/5): H by m^(-10/9)."""
    cushion = Cushion.of_sand(1000.0, 1e6)
    g = Gallery(1000.0, 10.0, 10.0, cushion, Shear(1e11, capacity=8e5, damping=0.0),
                Slab.of_mass(1e5, 1e12, damping=0.0), weight=False)  # fmt: skip
    light, heavy = rockfall.capacity_heights(g, [1000.0, 4000.0])
    assert heavy / light == pytest.approx(4 ** (-10 / 9), rel=0.01)
    assert light == pytest.approx((8e5 / 609.524e3) ** (5 / 3) * 10.0, rel=0.01)
    near = (rockfall.with_boulder(g, 4000.0, share * heavy) for share in (0.99, 1.01))
    below, above = map(rockfall.design_check, near)
    assert below.share < 1 < above.share


def test_the_map_has_a_row_per_boulder_and_grows_both_ways():
    table = rockfall.capacity_map(BOUNDED, [500.0, 2000.0, 4000.0], [2.0, 8.0])
    share = np.array([[v.share for v in row] for row in table])
    assert share.shape == (3, 2)
    assert (np.diff(share, axis=0) > 0).all() and (np.diff(share, axis=1) > 0).all()
    layered = replace(BOUNDED, cushion=rockfall.Layer.of_sand(4000.0, 1e6, 0.9))
    radius = rockfall.with_boulder(layered, 500.0).cushion.radius
    assert radius == pytest.approx(layered.cushion.radius / 2)
    through = rockfall.design_check(rockfall.with_boulder(layered, 4000.0, 200.0))
    assert through.state == "through" and through.share == np.inf
    light = rockfall.with_boulder(layered, 500.0, 8.0)
    deepest = strike(light).deepest
    assert rockfall.design_check(light, depth=0.5).cushion == pytest.approx(2 * deepest / 0.9)
