"""Compiled loops: the laws of cushion and plug, and the steps of the impact."""

import math

import numpy as np

from rom.components.compiled import inner, kernel


@kernel
def cushion(d, deepest, c):
    """Force at penetration d of a cushion that has been as deep as ``deepest`` >= d."""
    left = (1.0 - c[2]) * deepest
    if d <= left or d <= 0.0:
        return 0.0
    largest = c[0] * deepest ** c[1] / (1.0 - deepest / c[3]) ** c[4]
    return largest * ((d - left) / (deepest - left)) ** c[1]


@inner
def _shear(d, rate, s, state):
    """Force of the plug, and whether it is whole (0), cracked (1) or punched (2)."""
    if state == 0 and abs(s[0] * d) > s[1]:
        state = 1
    if state == 1 and abs(d) > s[3]:
        state = 2
    return (s[0] * d + s[4] * rate, s[2] * d, 0.0)[state], state


@kernel
def strike(numbers, modes, h, every, out, last):
    """Rows of out: time, ways, speeds, forces, energies, modes; last: peaks and what stays."""
    (m1, m2, g, v1), c, s, (zeta, capacity, k3) = numbers
    phi, omega = modes
    z1, z2, v2, d, e, F1, F2, deepest, yielded = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    q, w, took, state = np.zeros(phi.size), np.zeros(phi.size), np.zeros(7), 0
    for i in range(every * (out.shape[0] - 1) + 1):
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
        if i % every == 0:
            out[i // every, 17:] = q
        half = h if i else 0.5 * h
        n1, n2 = v1 + half * (g - F1 / m1), v2 + half * (F1 - F2) / m2
        u1, u2, u3 = (0.5 * (v1 + n1), 0.5 * (v2 + n2), 0.0) if i else (v1, v2, 0.0)
        took[0], took[3], took[6] = 0.5 * m1 * u1**2 + 0.5 * m2 * u2**2, 0.0, m1 * g * z1
        for k in range(phi.size):
            x = q[k] - yielded / phi[k] if yielded != 0.0 else q[k]
            b = zeta * omega[k] * half
            n = ((1.0 - b) * w[k] + half * (phi[k] * F2 - omega[k] ** 2 * x)) / (1.0 + b)
            u = 0.5 * (w[k] + n)
            u3 += phi[k] * u
            took[0] += 0.5 * u * u
            took[3] += 0.5 * (omega[k] * x) ** 2
            took[4] += 2.0 * b * u * u
            w[k] = n
            q[k] += h * n
        if i % every == 0:
            row = out[i // every]
            row[:10] = i * h, z1, z2, z3, u1, u2, u3, F1, F2, F3
            row[10:17] = took
        last[0], last[1], last[2] = max(last[0], F1), max(last[1], F2), max(last[2], F3)
        last[4] = max(last[4], z3)
        v1, v2 = n1, n2
        z1, z2 = z1 + h * v1, z2 + h * v2
    last[3], last[5], last[6] = deepest, yielded, state
