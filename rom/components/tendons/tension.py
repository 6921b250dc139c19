"""How the tension of a cable follows from its stretch, and how friction shares it out.

The cable has no mass, and its strain is uniform but for friction: of the free length L0, L0 l / L
lies in a piece of length l. What flows over station j towards the end, seen from its body, is

    r_j = d/dt (L0 a_j / L),  a_j the length behind it,

and turns the friction there: T_j+1 / T_j = exp(mu_j theta_j tanh(r_j / v0)) (Euler and Eytelwein).
The pieces stretch together as far as the ends ask for, sum T_i l_i = T L with the tension T that
there is without friction. Then the power lost is stretch times r_j (T_j+1 - T_j), never below zero.
Rope that a winch lets out enters at the first station. A cable that is pulled by a given force has
it in its first piece and is not stretched.
"""

import math

from rom.components.tendons.routing import (
    between,
    place_piece_stiffness,
    place_turning_gradient,
    pulley_axis,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness

EA, DAMPING, GIVEN, SPEED = range(4)  # columns of Tendons.law


@inner
def last_piece(tendons, k):
    """The first station of tendon k, and the last, behind which there is no piece."""
    return tendons.first[k], tendons.first[k + 1] - 1


@inner
def whole_length(tendons, k):
    """Length of tendon k [m] and its rate [m/s]."""
    first, last = last_piece(tendons, k)
    length, rate = 0.0, 0.0
    for i in range(first, last):
        length += tendons.length[i]
        rate += tendons.rate[i]
    return length, rate


@inner
def free_length(W, tendons, k):
    """Free length of tendon k and its rate; of one that is pulled, its length."""
    if tendons.pulled[k] == 1:
        return whole_length(tendons, k)
    if tendons.signal[k] >= 0:
        return W.signal[tendons.signal[k], 0], W.signal[tendons.signal[k], 1]
    return tendons.law[k, GIVEN], 0.0


@inner
def mean_tension(W, tendons, k):
    """Tension without friction, its elastic part, and derivatives by length and by its rate."""
    law, signal = tendons.law[k], tendons.signal[k]
    if tendons.pulled[k] == 1:
        force = law[GIVEN] + (W.signal[signal, 0] if signal >= 0 else 0.0)
        return W.load[0] * force, 0.0, 0.0, 0.0
    length, rate = whole_length(tendons, k)
    free, free_rate = free_length(W, tendons, k)
    if not free > 0.0:  # a winch took in all of it
        return math.nan, math.nan, 0.0, 0.0
    elastic = law[EA] * (length / free - 1.0)
    if elastic <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    loss = law[DAMPING] * (rate - length / free * free_rate) / free
    if abs(loss) >= elastic:  # a cable does not push, and its force does not jump as it tightens
        side = 1.0 + math.copysign(1.0, loss)
        return side * elastic, elastic, side * law[EA] / free, 0.0
    stiffness = (law[EA] - law[DAMPING] * free_rate / free) / free
    return elastic + loss, elastic, stiffness, law[DAMPING] / free


@inner
def stored_energy(W, tendons, k):
    """Energy of tendon k [J]: that of uniform strain."""
    if tendons.pulled[k] == 1:
        return 0.0
    length, _ = whole_length(tendons, k)
    free, _ = free_length(W, tendons, k)
    stretch = max(length / free - 1.0, 0.0)
    return 0.5 * tendons.law[k, EA] * stretch * stretch * free


@inner
def share_tension(W, tendons, k):
    """Set weight, flow and tension of the pieces of tendon k."""
    first, last = last_piece(tendons, k)
    length, rate = whole_length(tendons, k)
    free, free_rate = free_length(W, tendons, k)
    behind, behind_rate, weight, shared = length, rate, 1.0, 0.0
    for i in range(first, last):
        if i > first:
            behind -= tendons.length[i - 1]
            behind_rate -= tendons.rate[i - 1]
            change = (behind_rate - behind * rate / length) / length
            tendons.flow[i] = free_rate * behind / length + free * change
            slip = math.tanh(tendons.flow[i] / tendons.law[k, SPEED])
            weight *= math.exp(tendons.friction[i] * tendons.wrap[i] * slip)
        tendons.weight[i] = weight
        shared += weight * tendons.length[i]
    tension = mean_tension(W, tendons, k)[0]
    if tendons.pulled[k] == 0:
        tension *= length / shared
    for i in range(first, last):
        tendons.tension[i] = tension * tendons.weight[i]


@inner
def add_powers(W, tendons, k):
    """Add what winch, actuator and friction of tendon k do to the powers."""
    first, last = last_piece(tendons, k)
    length, rate = whole_length(tendons, k)
    free, free_rate = free_length(W, tendons, k)
    stretch, start, taken = length / free, tendons.tension[first], 0.0
    elastic = mean_tension(W, tendons, k)[1]
    for i in range(first, last):
        taken += tendons.tension[i] * tendons.rate[i]
    if tendons.pulled[k] == 1:
        W.power[1] -= start * rate
    else:
        W.driven[0] -= free_rate * (stretch * start - 0.5 * elastic * (stretch - 1.0))
    W.power[2] += taken - elastic * (rate - stretch * free_rate) - stretch * start * free_rate


@inner
def tension_slopes(W, tendons, k):
    """Set slope[0], [1], [2]: derivatives of each tension by lengths, their rates, and angles."""
    first, last = last_piece(tendons, k)
    slope, n = tendons.slope, last - first
    for i in range(n):
        for c in range(n):
            for kind in range(3):
                slope[kind, i, c] = slope[kind, i - 1, c] if i > 0 else 0.0
        if i > 0:
            add_slip_slopes(W, tendons, k, first + i)
    _, _, by_length, by_rate = mean_tension(W, tendons, k)
    length, shared = whole_length(tendons, k)[0], 0.0
    for i in range(first, last):
        shared += tendons.weight[i] * tendons.length[i]
    for c in range(n):
        own = tendons.weight[first + c] / shared - 1.0 / length
        for kind in range(3):
            mean = own if kind == 0 else 0.0
            for i in range(n):
                part = tendons.weight[first + i] * tendons.length[first + i] / shared
                mean += part * slope[kind, i, c]
            if tendons.pulled[k] == 1:
                mean = 0.0
            grow = by_length if kind == 0 else (by_rate if kind == 1 else 0.0)
            for i in range(n):
                share = tendons.weight[first + i] * length / shared
                change = tendons.tension[first + i] * (slope[kind, i, c] - mean)
                slope[kind, i, c] = change + grow * share


@inner
def add_slip_slopes(W, tendons, k, j):
    """Add to the slopes of the pieces behind station j how its friction changes."""
    first, last = last_piece(tendons, k)
    length, rate = whole_length(tendons, k)
    free, free_rate = free_length(W, tendons, k)
    behind, behind_rate = 0.0, 0.0
    for i in range(j, last):
        behind += tendons.length[i]
        behind_rate += tendons.rate[i]
    by_behind = (free_rate - free * rate / length) / length
    by_behind_rate, by_rate = free / length, -free * behind / length**2
    by_length = -(free_rate * behind + free * behind_rate - 2 * free * behind * rate / length)
    by_length /= length**2
    if tendons.pulled[k] == 1:
        by_behind, by_behind_rate, by_length, by_rate = 0.0, 1.0, 0.0, 0.0
    speed = tendons.law[k, SPEED]
    slip = math.tanh(tendons.flow[j] / speed)
    grip = tendons.friction[j] * tendons.wrap[j] * (1.0 - slip * slip) / speed
    row = j - first
    for c in range(last - first):
        after = 1.0 if c >= row else 0.0
        tendons.slope[0, row, c] += grip * (by_length + after * by_behind)
        tendons.slope[1, row, c] += grip * (by_rate + after * by_behind_rate)
    tendons.slope[2, row, row] += tendons.friction[j] * slip


@inner
def place_tangents(s, W, tendons, k, ck, cc):
    """Add ck times the stiffness of tendon k to W.Kt and cc times its damping to W.S."""
    first, last = last_piece(tendons, k)
    n = 6 * (last - first + 1)
    tendons.stiffness[:n, :n], tendons.damping[:n, :n] = 0.0, 0.0
    for i in range(first, last):
        place_turning_force(W, tendons, first, i)
    for i in range(first + 1, last):
        if tendons.radius[i] == 0.0 and tendons.friction[i] > 0.0:
            place_turning_gradient(tendons, i)
    for i in range(first, last):
        change_of_tension(tendons, k, i)
        at = 6 * (i - first)
        for p in range(12):
            for q in range(n):
                tendons.stiffness[at + p, q] += tendons.gradient[i, p] * tendons.change[0, q]
                tendons.damping[at + p, q] += tendons.gradient[i, p] * tendons.change[1, q]
    for a in range(first, last + 1):
        for b in range(a, last + 1):
            place_pair(s, W, tendons, (first, a, b), ck, W.Kt, tendons.stiffness)
            if tendons.rated[k] == 1:
                place_pair(s, W, tendons, (first, a, b), cc, W.S, tendons.damping)


@inner
def place_turning_force(W, tendons, first, i):
    """Add the stiffness of the tension of piece i, and set how the rate of its length changes."""
    Q, at, a, b = W.Q, 6 * (i - first), tendons.at[i], tendons.at[i + 1]
    Q[:] = 0.0
    axes = pulley_axis(W, tendons, i), pulley_axis(W, tendons, i + 1)
    radii = tendons.radius[i], tendons.radius[i + 1]
    place_piece_stiffness(Q, 1.0, between(W, tendons, i), axes, radii)
    for q in range(12):
        total = 0.0
        for p in range(6):
            total += W.V[a, p] * Q[p, q] + W.V[b, p] * Q[6 + p, q]
            tendons.stiffness[at + p, at + q] += tendons.tension[i] * Q[p, q]
            tendons.stiffness[at + 6 + p, at + q] += tendons.tension[i] * Q[6 + p, q]
        tendons.rate_gradient[i, q] = total
        for p in range(3):
            tendons.bend[i, 12 * p + q] = Q[6 + p, q]


@inner
def change_of_tension(tendons, k, i):
    """Set change[0], [1] (6 m,): derivative of the tension of piece i by motions and velocities."""
    first, last = last_piece(tendons, k)
    change, slope, row = tendons.change, tendons.slope, i - first
    change[:, : 6 * (last - first + 1)] = 0.0
    for c in range(first, last):
        at, by_length, by_rate = 6 * (c - first), slope[0, row, c - first], slope[1, row, c - first]
        for p in range(3):
            change[0, at + p] -= by_length * tendons.pull[c, p]
            change[0, at + 6 + p] += by_length * tendons.pull[c, p]
        for p in range(12):
            change[0, at + p] += by_rate * tendons.rate_gradient[c, p]
            change[1, at + p] += by_rate * tendons.gradient[c, p]
        if c > first:
            arc = 0.5 * tendons.radius[c] * (by_length + slope[0, row, c - first - 1])
            by_wrap = slope[2, row, c - first] + arc
            for p in range(18):
                change[0, at - 6 + p] += by_wrap * tendons.wrap_gradient[c, p]


@inner
def place_pair(s, W, tendons, places, c, S, block):
    """Add c times the blocks of two stations, or of one with itself, to S."""
    first, a, b = places
    at, to = 6 * (a - first), 6 * (b - first)
    W.Q[:] = 0.0
    for p in range(6):
        for q in range(6):
            if a == b:
                W.Q[p, q] = c * block[at + p, at + q]
            else:
                W.Q[p, 6 + q] = c * block[at + p, to + q]
                W.Q[6 + p, q] = c * block[to + p, at + q]
    pair_stiffness(s, W, tendons.at[a], tendons.at[b], S)
