"""The correction of enhanced Craig-Bampton modes is that of one body: an assembly says so."""

import warnings

import numpy as np
import pytest

import rom
from cases.long import few
from cases.solid import block
from rom.errors import RomWarning


def chain(rng):
    """Two or three blocks in a row, and the eight lowest elastic frequencies of the whole."""
    height, width, step = rng.uniform(0.05, 0.15, 3)
    cells = rng.integers(4, 7, rng.integers(2, 4))
    ends = np.r_[0, np.cumsum(cells)] * step
    parts = [block((n * step, height, width), (n, 2, 2), origin=(x, 0, 0))
             for n, x in zip(cells, ends[:-1], strict=True)]  # fmt: skip
    whole = block((ends[-1], height, width), (cells.sum(), 2, 2))
    return parts, rom.modes(whole, 9).frequencies[6:]


def joined(parts, method):
    bodies, couplings = {}, []
    for i, part in enumerate(parts):
        touched = (["root"] if i else []) + (["tip"] if i < len(parts) - 1 else [])
        kinds = dict.fromkeys(touched, "full")
        bodies[f"part {i}"] = rom.reduce(part, method=method, interfaces=kinds, certify=False)
        if i:
            couplings.append(((f"part {i - 1}", "tip"), (f"part {i}", "root")))
    return rom.Assembly(bodies, tuple(couplings))


@pytest.mark.filterwarnings("ignore:.*fixed-interface modes are kept")
@pytest.mark.parametrize("seed", few(1, range(4)))
def test_enhanced_bodies_are_wrong_in_assemblies_and_that_is_said(seed):
    parts, full = chain(np.random.default_rng(seed))

    def error(method):
        return np.abs(joined(parts, method).frequencies()[6:9] / full - 1).max()

    with warnings.catch_warnings():
        warnings.simplefilter("error", RomWarning)
        moments = error(rom.MomentMatching((0.0,), 2))
    with pytest.warns(RomWarning, match=r"part 0.*enhanced .* off by per cents"):
        enhanced = error(rom.EnhancedCraigBampton(8))
    plain = error(rom.CraigBampton(8))
    assert moments < 1e-4 and moments < plain < 5e-3 and 5 * plain < enhanced
