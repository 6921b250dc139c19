"""Films that conserve their oil and remember where it is: its balance in time, fronts, restarts."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.films import SPEED, VISCOSITY, held_rotor, on_ground
from cases.mbs.mechanisms import prepared, residual_at
from rom.components.journal_bearing.films.journals import FIRST_CONTENT

C = 1e-4  # clearance [m]


def bearing(grooves, cells=(60, 6), **more):
    return rom.mbs.JournalBearing(0.1, 0.05, C, grooves, cells=cells, cavitation="jfo", **more)


def contents(sol):
    """(n_t, nt, nz) film times filling over the clearance that is remembered."""
    packed, b = sol.packed, sol.mechanism.journal_bearings["film"].bearing
    first = len(packed.places.coordinates) + FIRST_CONTENT
    return sol.base[:, first : first + np.prod(b.cells)].reshape(-1, *b.cells)


def flows(b, motion, P, fill, speed):
    """(nt, nz) oil that comes into each cell, from pressure and filling, over its size [1/s]."""
    (nt, nz), grid = b.cells, b.grid
    around, dZ, half = 2 * np.pi / nt, np.diff(grid.Z_face)[0], np.ones(nz + 1)
    half[0], half[-1] = 2.0 * (not b.aligned), 2.0  # the drop to the ends takes half a cell
    x, y, fx, fy = motion / b.scale

    def film(face, z):
        c, s = grid.angle[face, :, :1], grid.angle[face, :, 1:]
        return 1 - (x + z * fy) * c - (y - z * fx) * s

    behind, across = film(1, grid.Z), film(0, grid.Z_face)
    upstream = fill if speed > 0 else np.roll(fill, -1, axis=0)
    drag = 6 * speed * upstream * behind - behind**3 * (np.roll(P, -1, axis=0) - P) / around
    leak = -(across**3) * np.diff(np.pad(P, [(0, 0), (1, 1)])) * half * grid.slender / dZ * around
    into = (np.roll(drag, 1, axis=0) - drag) * dZ + leak[:, :-1] - leak[:, 1:]
    return into / (12 * around * dZ)


def driven_film(b, speed, t, x, y):
    """Contents (n, nt, nz), and what comes in (n - 1, nt, nz), as a journal is led through x, y."""
    packed, W = prepared(on_ground(b, at=(x[0], y[0], 0), turning=0.0))
    (table,), first = packed.elements.values(), len(packed.places.coordinates)
    q, v, content, into = packed.q.copy(), np.zeros(6), [], []
    for k, now in enumerate(t):
        W.signal[table.clock[0], 0], v[5] = now, speed
        q[:2], v[:2] = (x[k], y[k]), (np.gradient(x, t)[k], np.gradient(y, t)[k])
        residual_at(packed.system, W, q, v, 0 * v, np.zeros(0))
        W.base[first:] = W.fresh
        content.append(W.fresh[FIRST_CONTENT:].reshape(b.cells).copy())
        P, fill = (a[0].reshape(b.cells) for a in (table.films.P, table.films.fill))
        into.append(flows(b, np.array([x[k], y[k], 0, 0]), P, fill, speed))
    return np.array(content), np.array(into[1:])


@pytest.mark.parametrize("speed", [SPEED, -SPEED, 0.0])
@pytest.mark.parametrize("aligned", [True, False])
def test_oil_that_comes_in_stays_or_leaves(speed, aligned):
    b = bearing([rom.mbs.Groove(1.0, 0.3, 2e4, share=0.5)], aligned=aligned)
    t = np.arange(0, 0.1, 1e-3)
    x, y = C * (0.3 + 0.4 * np.sin(80 * t)), C * 0.5 * np.sin(50 * t)
    content, into = driven_film(b, speed, t, x, y)
    free, dt = b.grid.fixed == 0, np.diff(t)[:, None]
    grown = np.diff(content, axis=0)[:, free] / dt
    size = np.abs(into).max()
    assert np.abs(grown).max() > 0.05 * size  # something happens
    assert_allclose(grown, into[:, free], atol=1e-10 * size)
    total, came = (content[-1] - content[0])[free].sum(), (into[:, free] * dt).sum()
    assert total == pytest.approx(came, abs=1e-10 * np.abs(into[:, free] * dt).sum())
    assert content.min() > -1e-12


def test_a_simulated_motion_keeps_the_same_oil():
    """Driven by joints, step by step as above; its last corrections are the difference."""
    b = bearing([rom.mbs.Groove(1.0, 0.3, 2e4, share=0.5)])
    t = np.arange(0, 0.05, 1e-3)
    moves = [lambda t: C * (0.3 + 0.4 * np.sin(80 * t)), lambda t: C * 0.5 * np.sin(50 * t)]
    mech = held_rotor(b, (0, 0), speed=SPEED, oil=VISCOSITY, moves=moves)
    sol = rom.simulate(mech, t_end=t[-1], dt=1e-3, progress=False)
    content, _ = driven_film(b, SPEED, t, *(move(t) for move in moves))
    # the first instant stays by its rates, which differences do not tell exactly
    assert_allclose(contents(sol)[-1], content[-1], atol=2e-3)


def emptied(sol):
    base, at = sol.final.base.copy(), len(sol.packed.places.coordinates) + FIRST_CONTENT
    base[at:] = 0.0
    return replace(sol.final, base=base, memory=None, algorithmic=None)


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_oil_from_a_groove_travels_with_half_the_speed(speed):
    b = bearing([rom.mbs.Groove(np.pi, 0.1)], (240, 2), aligned=True)
    still = (lambda t: 0.0, lambda t: 0.0)
    mech = held_rotor(b, (0, 0), speed=speed, oil=VISCOSITY, moves=still)
    begun = rom.simulate(mech, t_end=1e-3, dt=5e-4, progress=False)
    sol = rom.simulate(mech, t_end=0.041, dt=1e-4, progress=False, state=emptied(begun))
    content, free = contents(sol)[-1], b.grid.fixed[:, 0] == 0
    gone = 0.5 * SPEED * 0.04
    step = 2 * np.pi / 240
    # nothing but the end of the groove feeds it, each second half the speed
    assert content[free, 0].sum() * step == pytest.approx(gone, rel=1e-10)
    theta = np.angle(np.exp(1j * (step * np.arange(240) - np.pi))) * np.sign(speed)
    there = (theta > 0.1) & (theta < gone - 0.9)
    assert_allclose(content[there, 0], 1.0, atol=1e-3)
    assert np.abs(content[(theta > gone + 0.9) | (theta < -0.1), 0]).max() < 1e-3


def test_a_film_that_was_empty_carries_less_until_oil_has_come():
    b = bearing([rom.mbs.Groove(np.pi, 0.3)], (60, 4), aligned=True)
    place = (lambda t: 0.6 * C, lambda t: 0.0)
    mech = held_rotor(b, (0, 0), speed=SPEED, oil=VISCOSITY, moves=place)
    begun = rom.simulate(mech, t_end=1e-3, dt=5e-4, progress=False)
    full = begun.journal_bearing("film").pressure[-1]
    sol = rom.simulate(mech, t_end=0.4, dt=1e-3, progress=False, state=emptied(begun))
    top = sol.journal_bearing("film").pressure
    assert top[5] < 1e-3 * full
    assert top[-1] == pytest.approx(full, rel=1e-6)


def test_a_motion_that_is_interrupted_remembers_its_oil():
    b = bearing([rom.mbs.Groove(1.0, 0.3)], (40, 4), aligned=True)
    mech = held_rotor(b, (0, 0), speed=SPEED, oil=VISCOSITY,
                      moves=(lambda t: C * 0.5 * np.sin(80 * t), lambda t: 0.2 * C))  # fmt: skip
    whole = rom.simulate(mech, t_end=0.04, dt=1e-3, progress=False)
    half = rom.simulate(mech, t_end=0.02, dt=1e-3, progress=False)
    rest = rom.simulate(mech, t_end=0.04, dt=1e-3, progress=False, state=half.final)
    assert_allclose(contents(rest)[-1], contents(whole)[-1], rtol=1e-9, atol=1e-12)
    again = replace(half.final, memory=None)  # of the method, not of the film
    rest = rom.simulate(mech, t_end=0.04, dt=1e-3, progress=False, state=again)
    assert_allclose(contents(rest)[-1], contents(whole)[-1], rtol=1e-9, atol=1e-12)


def test_steps_of_half_the_length_differ_half_as_much():
    """Backward Euler of the filling: first order."""
    b = bearing([rom.mbs.Groove(1.0, 0.3)], (40, 4), aligned=True)
    moves = (lambda t: C * (0.3 + 0.2 * np.sin(80 * t)), lambda t: 0.2 * C)
    mech = held_rotor(b, (0, 0), speed=SPEED, oil=VISCOSITY, moves=moves)
    peaks = []
    for dt in (4e-4, 2e-4, 1e-4):
        sol = rom.simulate(mech, t_end=0.1, dt=dt, progress=False)
        peaks.append(contents(sol).sum(axis=(1, 2))[:: round(4e-4 / dt)][1:].mean())
    assert 0.7 < np.log2((peaks[0] - peaks[1]) / (peaks[1] - peaks[2])) < 1.3


def test_loads_asked_for_afterwards_are_those_of_the_motion():
    """They follow from the oil at the instant before, not from a film that stays."""
    b = bearing([rom.mbs.Groove(1.0, 0.3)], (40, 4), aligned=True)
    moves = (lambda t: C * (0.3 + 0.5 * np.sin(80 * t)), lambda t: 0.2 * C)
    mech = held_rotor(b, (0, 0), speed=SPEED, oil=VISCOSITY, moves=moves)
    sol = rom.simulate(mech, t_end=0.03, dt=1e-3, progress=False)
    found = sol.element("film")
    # what drives the shaft along X carries the film, and the shaft's inertia
    driven = sol.drive_load("move x") - 10.0 * (1 + 2e-6) * sol.a[:, 0]
    assert_allclose(driven[1:], -found.force[1:, 0, 0], rtol=1e-6, atol=1e-6)
    assert_allclose(found.lost[1:], sol.journal_bearing("film").power[1:], rtol=1e-7)
