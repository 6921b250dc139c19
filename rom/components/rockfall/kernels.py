"""Compiled loops: the laws of cushion and plug, and the steps of the impact."""

import math

import numpy as np

from rom.components.compiled import inner, kernel

POWER_LAW, CONE_LAW = 0.0, 1.0
SERIES_BELOW = 1e-3  # where five terms of the logarithm are exact to round-off
# a peak that grows by less does not keep the impact going; far below what is known of a cushion
PEAK_RTOL = 1e-3
GAUSS_POINTS, GAUSS_WEIGHTS = (tuple(x.tolist()) for x in np.polynomial.legendre.leggauss(8))
RELEASED_RATIO = 0.05  # of the largest force, beside twice the weight: the cushion has let go


@inner
def _log_remainder(y):
    """-log(1 - y) - y."""
    if y > SERIES_BELOW:
        return -math.log1p(-y) - y
    return y**2 * (0.5 + y * (1.0 / 3.0 + y * (0.25 + y * (0.2 + y / 6.0))))


@inner
def _cone(d, modulus, radius, slope, thickness, strength):
    """Integral of the stiffness E pi a (a + t s) / t of a cone on a disc a, t = thickness - d.

    At most the strength on the contact.
    """
    x = min(d, radius)  # a^2 = 2 R x - x^2
    squares = thickness * (2.0 * radius - thickness) * _log_remainder(x / thickness) + 0.5 * x**2
    angle = 2.0 * math.asin(math.sqrt(0.5 * x / radius))
    widths = 0.5 * radius**2 * (angle - math.sin(angle) * math.cos(angle))
    if d > radius:
        squares += radius**2 * math.log((thickness - radius) / (thickness - d))
        widths += radius * (d - radius)
    elastic = modulus * math.pi * (squares + slope * widths)
    return min(elastic, strength * math.pi * x * (2.0 * radius - x))


@inner
def _loading(d, c):
    law, _, n, k, limit, p, r, strength = c
    if d >= limit:
        return math.nan
    if law == CONE_LAW:
        return _cone(d, k, p, r, limit, strength)
    return k * d**n / (1.0 - d / limit) ** p


@inner
def _work(d, force, c):
    """Energy taken up on the way to penetration d, where the force is given."""
    law, _, n, _, _, p, _, _ = c
    if law == POWER_LAW and p == 0.0:
        return force * d / (n + 1.0)
    total = 0.0
    for k in range(8):
        total += GAUSS_WEIGHTS[k] * _loading(0.5 * d * (1.0 + GAUSS_POINTS[k]), c)
    return 0.5 * d * total


@kernel
def cushion(d, deepest, c):
    """Force at penetration d of a cushion that has been as deep as ``deepest`` >= d.

    The way back, d - left at the start, gives back the share of the work.
    """
    _, recovery, n, _, _, _, _, _ = c
    if d <= 0.0:
        return 0.0
    largest = _loading(deepest, c)
    if d >= deepest:
        return largest
    back = (n + 1.0) * recovery * _work(deepest, largest, c) / largest
    if d <= deepest - back:
        return 0.0
    return largest * ((d - deepest + back) / back) ** n


@inner
def _shear(d, rate, s, state):
    """Force of the plug, and whether it is whole (0), cracked (1) or punched (2)."""
    whole, capacity, reinforced, ultimate, damping = s
    if state == 0 and abs(whole * d) > capacity:
        state = 1
    if state == 1 and abs(d) > ultimate:
        state = 2
    return (whole * d + damping * rate, reinforced * d, 0.0)[state], state


@inner
def _thin(out, rows):
    """Leave every second row."""
    for i in range(rows // 2):
        out[i] = out[2 * i]
    return rows // 2


@inner
def _grown(last, marked):
    """Whether one of the three peaks or the deflection has grown, which is remembered."""
    grown = False
    for k in range(marked.size):
        value = last[k] if k < marked.size - 1 else last[4]
        if value > (1.0 + PEAK_RTOL) * marked[k]:
            marked[k], grown = value, True
    return grown


@kernel
def strike(numbers, modes, steps, out, last):
    """Rows of out: time, ways, speeds, forces, energies, modes; last: peaks and what stays.

    Gives the number of rows; the impact ends after n steps, or when the cushion has let go and no
    peak has grown for ``quiet`` ones. With ``again`` a boulder that its weight brings back is
    awaited, as long as a blow lets a peak grow. Rows that are full are thinned.
    """
    (m1, m2, g, v1), c, s, (zeta, capacity, k3) = numbers
    (phi, omega), (h, n, every, quiet, again) = modes, steps
    z1, z2, v2, d, e, F1, F2, deepest, yielded = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    q, w, took, state = np.zeros(phi.size), np.zeros(phi.size), np.zeros(7), 0
    shape, marked, mark, rows, pressed = k3 * phi / omega**2, np.zeros(4), 0, 0, True
    awaited, flies = again > 0 and g > 0.0, False
    for i in range(n + 1):
        d0, e0, f1, f2 = d, e, F1, F2
        z3, v3 = (phi * q).sum(), (phi * w).sum()
        d, e, deepest = z1 - z2, z2 - z3, max(deepest, z1 - z2)
        F1 = cushion(d, deepest, c)
        F2, state = _shear(e, v2 - v3, s, state)
        flow = k3 * abs(z3 - yielded) - capacity
        if flow > 0.0:
            yielded += math.copysign(flow / k3, z3 - yielded)
            took[5] += capacity * flow / k3
        F3 = k3 * (z3 - yielded + 2.0 * zeta * (phi / omega * w).sum())
        took[1] += 0.5 * (F1 + f1) * (d - d0)
        took[2] += 0.5 * (F2 + f2) * (e - e0)
        if rows == out.shape[0]:
            rows, every = _thin(out, rows), 2 * every
        kept = i % every == 0
        if kept:
            out[rows, 17:] = q
        half = h if i else 0.5 * h
        n1, n2 = v1 + half * (g - F1 / m1), v2 + half * (F1 - F2) / m2
        u1, u2 = (0.5 * (v1 + n1), 0.5 * (v2 + n2)) if i else (v1, v2)
        took[0], took[3], took[6] = 0.5 * m1 * u1**2 + 0.5 * m2 * u2**2, 0.0, m1 * g * z1
        u3 = 0.0
        for k in range(phi.size):
            x = q[k] - yielded * shape[k]
            b = zeta * omega[k] * half
            after = ((1.0 - b) * w[k] + half * (phi[k] * F2 - omega[k] ** 2 * x)) / (1.0 + b)
            u = 0.5 * (w[k] + after)
            u3 += phi[k] * u
            took[0] += 0.5 * u * u
            took[3] += 0.5 * (omega[k] * x) ** 2
            took[4] += 2.0 * b * u * u
            w[k] = after
            q[k] += h * after
        if kept:
            out[rows, :10] = i * h, z1, z2, z3, u1, u2, u3, F1, F2, F3
            out[rows, 10:17] = took
            rows += 1
        last[0], last[1], last[2] = max(last[0], F1), max(last[1], F2), max(last[2], F3)
        last[3], last[4], last[5], last[6] = deepest, max(last[4], z3), yielded, state
        if quiet > 0:
            pressed = pressed and (v1 >= v2 or F1 > RELEASED_RATIO * last[0] + 2.0 * m1 * g)
            grown = _grown(last, marked)
            if flies and F1 > 0.0:
                awaited = False  # unless this blow lets something grow
            awaited, flies = awaited or (grown and again > 0), F1 == 0.0 and g > 0.0
            if grown or pressed or (flies and awaited):
                mark = i
            if i - mark > quiet:
                return rows, True
        v1, v2 = n1, n2
        z1, z2 = z1 + h * v1, z2 + h * v2
    return rows, False
