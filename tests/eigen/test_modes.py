"""Modes of whatever has them: the count is called n, and the record is one."""

import inspect

import numpy as np
import pytest

import rom
from cases.files import border_calls as made
from rom.components import cosserat
from rom.errors import ConfigError

ROD = cosserat.straight(1.0, 8, stretch=1e4, bend=1.0, mass=1.0, inertia=1e-3)
FENICSX = [pytest.mark.fenicsx, pytest.mark.skipif(not made.FENICSX, reason="needs dolfinx"),
           pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")]  # fmt: skip


def assembly():
    return rom.Assembly(made.bodies(), made.TOGETHER)


WAYS = {  # function, its arguments before the count
    "modes": lambda: (rom.modes, [made.model()], {}),
    "FlexibleBody": lambda: (made.body().modes, [], {}),
    "Assembly": lambda: (assembly().modes, [], {}),
    "CondensedAssembly": lambda: (assembly().reduced(6).modes, [], {}),
    "MistunedWheel": lambda: (made.mistuned().modes, [np.zeros(4)], {}),
    "cyclic_modes": lambda: (rom.cyclic_modes, [made.spinning(), 2], {}),
    "travelling_modes": lambda: (rom.travelling_modes, [made.spinning(), 2], {"speed": 0.1}),
    "cosserat": lambda: (cosserat.modes, [ROD, cosserat.reference(ROD)], {}),
    "BladedWheel": lambda: (made.bladed().modes, [[made.blade()] * 6], {}),
    "ReducedSpinUp": lambda: (made.reduced_run_up().modes, [], {"speed": 5.0}),
}
LATE = {"BladedWheel", "ReducedSpinUp"}
CASES = [pytest.param(way, marks=FENICSX if way in LATE else []) for way in WAYS]


@pytest.mark.parametrize("way", CASES)
def test_the_count_is_called_n_and_the_record_is_one(way):
    function, before, words = WAYS[way]()
    names = [*inspect.signature(function).parameters]
    assert "m" not in names and names.index("n") == len(before)
    found = function(*before, n=2, **words)
    assert isinstance(found, rom.Modes)
    assert found.omega.shape == found.frequencies.shape == (2,)
    omega, shapes = found
    assert omega is found.omega and shapes is found.shapes
    each = shapes.values() if isinstance(shapes, dict) else [shapes]
    assert all(columns.shape[-1] == 2 for columns in each)
    more = function(*before, 3, **words).omega
    np.testing.assert_allclose(more[:2], omega, rtol=1e-6, atol=1e-6 * more[-1])
    with pytest.raises(ConfigError, match="n = -1 must be a whole number"):
        function(*before, -1, **words)
