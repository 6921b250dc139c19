"""What a factor is said to cost, beside what MUMPS counted and what the clock showed."""

import pytest

from rom.fe.costs import factor_cost, least_machines, reduction_seconds

# dofs, flops, entries, of beams of quadratic tetrahedra, by the analysis of MUMPS
COUNTED = [
    (11_256, 4.870e8, 2.157e6),
    (29_286, 4.173e9, 9.269e6),
    (100_995, 6.606e10, 6.061e7),
]
NOT_FITTED = (1_067_634, 7.88e12, 1.756e9, 17.8e9)  # the same and the memory taken
# dofs, seconds of the factorisation, of 21 solutions for six columns, of the whole: one thread
TIMED = [(29_286, 0.42, 0.60, 1.65), (100_995, 3.3, 3.2, 8.6), (299_967, 21.0, 14.0, 42.0)]


@pytest.mark.parametrize(("n", "flops", "entries"), COUNTED)
def test_sizes_of_the_fit(n, flops, entries):
    cost = factor_cost(n)
    assert cost.flops == pytest.approx(flops, rel=0.25)
    assert cost.entries == pytest.approx(entries, rel=0.15)


def test_a_size_it_was_not_fitted_to():
    """Three and a half times the largest; above what was counted, by 13 % and 7 %."""
    n, flops, entries, memory = NOT_FITTED
    cost = factor_cost(n)
    assert 1.0 < cost.flops / flops < 1.2
    assert 1.0 < cost.entries / entries < 1.1
    assert cost.memory == pytest.approx(memory, rel=0.1)


@pytest.mark.parametrize(("n", "factor", "solutions", "whole"), TIMED)
def test_times_that_were_measured(n, factor, solutions, whole):
    cost = factor_cost(n)
    assert cost.seconds == pytest.approx(factor, rel=0.2)
    assert 21 * cost.solution_seconds == pytest.approx(solutions, rel=0.2)
    assert reduction_seconds(n, 12, 20) == pytest.approx(whole, rel=0.1)


def test_a_mode_and_an_interface_cost_solutions():
    n = 100_995
    one = factor_cost(n).solution_seconds
    base = reduction_seconds(n, 12, 20)
    assert reduction_seconds(n, 18, 20) - base == pytest.approx(one)
    assert one < reduction_seconds(n, 12, 21) - base < 2 * one


def test_machines_are_whole_and_hold_the_factor():
    need = factor_cost(3e6).memory
    for memory in (16e9, 64e9, need, 1e15):
        machines = least_machines(3e6, memory)
        assert machines * memory >= need > (machines - 1) * memory
