"""Campbell diagrams of wheels: waves that cross keep their names."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import block_diag, csr_matrix, diags, identity

import rom
from cases.wheels import beam_ring, mass_ring
from rom.components.wheels.sector import CyclicSector
from rom.errors import ConfigError

N, C = 6, 3.0
SPEEDS = np.linspace(0.0, 400.0, 9)


def two_rings():
    """Masses of 0.4 kg on springs, twice; centrifugal stress stiffens the softer ones."""
    rings = [mass_ring(N, k=3e5), mass_ring(N, k=4e5)]
    return CyclicSector(
        N, *(csr_matrix(block_diag([getattr(r, a) for r in rings])) for a in "KM"),
        np.array([1, 3]), np.array([0, 2]), identity(2, format="csr"), sprung=True,
        coriolis=csr_matrix((4, 4)), centrifugal=csr_matrix(diags([0.5 * C, 0.5 * C, 0.0, 0.0])),
    )  # fmt: skip


@pytest.mark.parametrize("n", [0, 2, 3])
def test_waves_that_cross_keep_their_columns(n):
    """omega^2 = (k + 4 c sin^2(pi n / N) + C Omega^2) / m of one ring, constant of the other."""
    waves = 2 if n in (0, 3) else 4
    found = rom.wheel_campbell(two_rings(), n, waves, speeds=SPEEDS)
    join = 4 * 0.7e5 * np.sin(np.pi * n / N) ** 2
    softer = np.sqrt((3e5 + join + C * SPEEDS**2) / 0.4)
    stiffer = np.sqrt((4e5 + join) / 0.4) + 0 * SPEEDS
    assert softer[0] < stiffer[0] and softer[-1] > stiffer[-1]
    exact = np.column_stack([softer, stiffer])
    sides = (
        [found.omega] if waves == 2 else [2 * np.pi * s for s in (found.forward, found.backward)]
    )
    for side in sides:
        assert_allclose(side, exact, rtol=1e-9)
    assert_allclose(found.mac, 1.0, rtol=1e-6)
    assert np.any(np.diff(found.omega[-1]) < 0)


def test_directions_start_together_and_part():
    """Of a ring, as `travelling_modes` has them at each speed; supported at one node a sector."""
    ring = replace(beam_ring(6, 4, EA=1e3, rotary=0.1), held=np.array([0, 1]))
    speeds = [0.0, 0.05, 0.1]
    found = rom.wheel_campbell(ring, 2, 4, speeds=speeds)
    assert_allclose(found.forward[0], found.backward[0])
    last = rom.travelling_modes(ring, 2, 4, speed=0.1)
    assert_allclose(found.forward[-1], last.forward, rtol=1e-9)
    assert_allclose(found.backward[-1], last.backward, rtol=1e-9)
    assert abs(found.forward[-1] - found.backward[-1]).max() > 1e-4


def test_speeds_and_numbers_that_make_no_diagram_are_named():
    with pytest.raises(ConfigError, match=r"none below 0"):
        rom.wheel_campbell(two_rings(), 1, 2, speeds=[0.0, -1.0])
    with pytest.raises(ConfigError, match="n = 5 must be a whole number from 1 to 4"):
        rom.wheel_campbell(two_rings(), 1, 5, speeds=[0.0])
    with pytest.raises(ConfigError, match=r"diameter = 4 must be a whole number from 0 to 3"):
        rom.wheel_campbell(two_rings(), 4, 1, speeds=[0.0])
