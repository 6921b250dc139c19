"""A run in two pieces has the bits of the run in one, through a file as well."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.mbs.mechanisms import simeon_crank, simulate_quietly, slider_crank
from cases.mbs.motions import PARTS, four_links, sampled, swing, wound_drive
from cases.refusals import refuses

CASES = [(swing, 1e-2), (simeon_crank, 1e-5), (wound_drive, 1e-3), (four_links, 1e-3)]
CASES.append((sampled, 2.5e-3))
PLAIN = [{}, {"rho_inf": 0.6}, {"method": "bdf"}]
# drives need their rates for these: differences end where a run ends
RATED = [{"stabilised": True}, {"method": "bdf", "order": 1}, {"method": "bdf", "order": 5}]
RUNS = [*product(CASES, PLAIN), *product([CASES[0], (slider_crank, 1e-3)], RATED)]


def pieces(build, dt, path, **options):
    """A whole run of 60 steps, and its second part after 23 of them, through a file."""
    whole = simulate_quietly(build(), t_end=60 * dt, dt=dt, **options)
    state = simulate_quietly(build(), t_end=23 * dt, dt=dt, **options).final
    state = rom.load_state(rom.save_state(state, path))
    return whole, simulate_quietly(build(), t_end=60 * dt, dt=dt, state=state, **options)


def told(x):
    """The name of a case, whatever process asks."""
    return x[0].__name__ if isinstance(x, tuple) else str(x)


@pytest.mark.parametrize(("case", "options"), RUNS, ids=told)
def test_a_run_goes_on_with_the_same_bits(case, options, tmp_path):
    whole, second = pieces(*case, tmp_path / "half.state.npz", **options)
    for name in PARTS:
        assert_array_equal(getattr(second, name), getattr(whole, name)[23:], err_msg=name)


@pytest.mark.parametrize("options", [{}, RATED[-1]], ids=str)
def test_saving_less_often_changes_no_bit(options):
    every = simulate_quietly(wound_drive(), t_end=0.06, dt=1e-3, **options)
    fourth = simulate_quietly(wound_drive(), t_end=0.06, dt=1e-3, save_every=4, **options)
    for name in PARTS:
        assert_array_equal(getattr(fourth, name), getattr(every, name)[::4], err_msg=name)


def test_a_time_that_has_no_binary_form_is_met_by_counting():
    """0.1 + 0.2 is not 0.3: steps are counted from the first start, times never summed up."""
    sol = simulate_quietly(swing(), t_end=0.1, dt=0.1 / 7)
    for t_end in (0.3, 0.7):
        sol = simulate_quietly(swing(), t_end=t_end, dt=0.1 / 7, state=sol.final)
    whole = simulate_quietly(swing(), t_end=0.7, dt=0.1 / 7)
    assert_array_equal(sol.q[-1], whole.q[-1])
    assert sol.t[-1] == whole.t[-1] == pytest.approx(0.7, abs=1e-15)


def test_another_step_or_method_forgets_the_factorisation():
    mech = swing()
    state = simulate_quietly(mech, t_end=0.1, dt=1e-2).final
    bare = replace(state, memory=None)
    for options in ({"dt": 5e-3}, {"dt": 1e-2, "rho_inf": 0.5}):
        one, other = (simulate_quietly(mech, t_end=0.2, state=s, **options) for s in (state, bare))
        # times are counted from the first step where one is remembered: equal to round-off
        assert_allclose(one.q, other.q, rtol=0, atol=1e-13)
        assert one.statistics["factorisations"] == other.statistics["factorisations"] >= 1


def test_a_state_file_says_what_is_wrong_with_it(tmp_path):
    state = simulate_quietly(swing(), t_end=0.05, dt=1e-2).final
    path = rom.save_state(state, tmp_path / "a.npz")
    data = path.read_bytes()
    assert rom.save_state(rom.load_state(path), tmp_path / "b.npz").read_bytes() == data
    at = data.index(state.q.tobytes())
    (tmp_path / "flipped.npz").write_bytes(data[:at] + b"\x01" + data[at + 1 :])
    (tmp_path / "cut.npz").write_bytes(data[: len(data) // 2])
    for name in ("flipped", "cut", "none"):
        with pytest.raises(rom.FileFormatError, match=r"not a complete state file|no such file"):
            rom.load_state(tmp_path / f"{name}.npz")
    refuses(rom.FileFormatError, "schema 'rom-state'", rom.load, path)
    with pytest.raises(rom.QualityGateError, match="v of the state must be finite"):
        rom.save_state(replace(state, v=state.v * np.nan), path)
    assert path.read_bytes() == data
    assert {p.stem for p in tmp_path.iterdir()} == {"a", "b", "cut", "flipped"}
