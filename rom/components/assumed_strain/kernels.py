"""Compiled loops: the law of the material, the element, and explicit steps.

Everything that is compiled together stands in this file, so that its cache is never stale.
"""

# ruff: noqa: PLR0913, C901  kernels take arrays, not records

import numpy as np

from rom.components.compiled import inner, kernel

MIN_AREA_RATIO = 0.15  # of a triangle's first area; smaller ones do not shorten the time step
COURANT_NUMBER = 0.6  # of the critical step
EQUAL_STRETCH_RTOL = 1e-6  # relative difference of principal stretches that count as equal
STRAIN_INCREMENT = 1e-6  # of the differences that give the tangent


@inner
def _returned(e11, e22, e12, e33, ep, numbers):
    """Stress T conjugate to ln U, and the plastic step: radial return."""
    K, mu = numbers[0], numbers[1]
    a, b, c, d = e11 - ep[0], e22 - ep[1], e33 - ep[3], e12 - ep[2]
    third = (a + b + c) / 3
    s11, s22 = 2 * mu * (a - third), 2 * mu * (b - third)
    s33, s12 = 2 * mu * (c - third), 2 * mu * d
    q = np.sqrt(1.5 * (s11 * s11 + s22 * s22 + s33 * s33 + 2 * s12 * s12))
    over, step, left = q - numbers[2] - numbers[3] * ep[4], 0.0, 1.0
    if over > 0:
        step = over / (3 * mu + numbers[3])
        left = 1 - 3 * mu * step / q
    p = 3 * K * third
    flow = (1 - left) / (2 * mu)  # of the trial deviator into plastic strain
    t11, t22, t12, t33 = p + left * s11, p + left * s22, left * s12, p + left * s33
    return t11, t22, t12, t33, flow * s11, flow * s22, flow * s12, flow * s33, step


@inner
def _stress(C11, C22, C12, C33, ep, numbers, state, out):
    """Second Piola-Kirchhoff stress S11, S22, S12, S33, then the plastic step, into ``out``."""
    K, mu = numbers[0], numbers[1]
    lam = K - 2 * mu / 3
    if numbers[4] > 0:
        E11, E22, E12, E33 = (C11 - 1) / 2, (C22 - 1) / 2, C12 / 2, (C33 - 1) / 2
        if state == 0:
            E33 = -lam / (lam + 2 * mu) * (E11 + E22)
        p = lam * (E11 + E22 + E33)
        out[0], out[1], out[2] = p + 2 * mu * E11, p + 2 * mu * E22, 2 * mu * E12
        out[3] = p + 2 * mu * E33
        out[4:] = 0.0
        return
    m, d = 0.5 * (C11 + C22), 0.5 * (C11 - C22)
    r = np.sqrt(d * d + C12 * C12)
    c, s = (d / r, C12 / r) if r > 1e-300 else (1.0, 0.0)  # of twice the principal angle
    l1, l2 = m + r, m - r
    g1, g2 = np.log(l1), np.log(l2)
    middle, half = 0.25 * (g1 + g2), 0.25 * (g1 - g2)
    e11, e22, e12 = middle + half * c, middle - half * c, half * s
    e33 = 0.5 * np.log(C33)
    if state == 0:
        e33 = ep[3] - lam / (lam + 2 * mu) * (e11 + e22 - ep[0] - ep[1])
        before, was = 0.0, 0.0
        for i in range(60):
            T33 = _returned(e11, e22, e12, e33, ep, numbers)[3]
            if abs(T33) < 1e-13 * mu:
                break
            slope = lam + 2 * mu if i == 0 or T33 == was else (T33 - was) / (e33 - before)
            before, was = e33, T33
            e33 -= T33 / slope
    T = _returned(e11, e22, e12, e33, ep, numbers)
    mean, beta = 0.5 * (T[0] + T[1]), 0.5 * (T[0] - T[1])
    turned, tau = beta * c + T[2] * s, T[2] * c - beta * s  # in the principal frame
    S1, S2 = (mean + turned) / l1, (mean - turned) / l2
    tau *= (g1 - g2) / (l1 - l2) if r > EQUAL_STRETCH_RTOL * m else 1 / m
    mean, beta = 0.5 * (S1 + S2), 0.5 * (S1 - S2)
    out[0], out[1] = mean + beta * c - tau * s, mean - beta * c + tau * s
    out[2], out[3] = beta * s + tau * c, T[3] / np.exp(2 * e33)
    for i in range(5):
        out[4 + i] = T[4 + i]


@inner
def _deformed(x, nodes, G, F):
    """F of each side of a point; its mean metric C11, C22, C12."""
    C11 = C22 = C12 = 0.0
    sides = G.shape[0]
    for s in range(sides):
        a = b = c = d = 0.0
        for i in range(6):
            gx, gy = G[s, i, 0], G[s, i, 1]
            X, Y = x[nodes[i], 0], x[nodes[i], 1]
            a, b, c, d = a + X * gx, b + X * gy, c + Y * gx, d + Y * gy
        F[s, 0, 0], F[s, 0, 1], F[s, 1, 0], F[s, 1, 1] = a, b, c, d
        C11, C22, C12 = C11 + a * a + c * c, C22 + b * b + d * d, C12 + a * b + c * d
    return C11 / sides, C22 / sides, C12 / sides


@inner
def _hoop(x, nodes, radius):
    """Stretch around the axis at the centroid; 1 without axial symmetry."""
    if radius == np.inf:
        return 1.0
    return (x[nodes[0], 0] + x[nodes[1], 0] + x[nodes[2], 0]) / (3 * radius)


@kernel
def forces(x, patch, G, weights, radius, numbers, state, history, f, new):
    """Add the internal forces f (n, 2) [N]; history (t, p, 5) becomes new."""
    sides = G.shape[2]
    F, out = np.empty((sides, 2, 2)), np.empty(9)
    for e in range(len(patch)):
        nodes, hoop = patch[e], _hoop(x, patch[e], radius[e])
        for p in range(G.shape[1]):
            C11, C22, C12 = _deformed(x, nodes, G[e, p], F)
            _stress(C11, C22, C12, hoop * hoop, history[e, p], numbers, state, out)
            for i in range(5):
                new[e, p, i] = history[e, p, i] + out[4 + i]
            w = weights[e, p] / sides
            for s in range(sides):
                P11 = w * (F[s, 0, 0] * out[0] + F[s, 0, 1] * out[2])
                P12 = w * (F[s, 0, 0] * out[2] + F[s, 0, 1] * out[1])
                P21 = w * (F[s, 1, 0] * out[0] + F[s, 1, 1] * out[2])
                P22 = w * (F[s, 1, 0] * out[2] + F[s, 1, 1] * out[1])
                for i in range(6):
                    f[nodes[i], 0] += P11 * G[e, p, s, i, 0] + P12 * G[e, p, s, i, 1]
                    f[nodes[i], 1] += P21 * G[e, p, s, i, 0] + P22 * G[e, p, s, i, 1]
            if radius[e] < np.inf:
                for i in range(3):
                    f[nodes[i], 0] += weights[e, p] * out[3] * hoop / (3 * radius[e])


@kernel
def tangents(x, patch, G, weights, radius, numbers, state, history, K):
    """Element tangents K (t, 12, 12) [N/m]: material part by differences, and geometric part."""
    sides = G.shape[2]
    F, out, B, D = np.empty((sides, 2, 2)), np.empty(9), np.empty((4, 12)), np.empty((4, 4))
    two = np.empty((2, 4))
    for e in range(len(patch)):
        nodes, hoop = patch[e], _hoop(x, patch[e], radius[e])
        for p in range(G.shape[1]):
            C = np.array((*_deformed(x, nodes, G[e, p], F), hoop * hoop))
            for j in range(4):
                for sign in range(2):
                    c = C.copy()
                    part = 2 if j != 2 else 1  # of 2 E12 it is E12
                    c[j] += part * STRAIN_INCREMENT * (1 - 2 * sign)
                    _stress(c[0], c[1], c[2], c[3], history[e, p], numbers, state, out)
                    two[sign] = out[:4]
                D[:, j] = (two[0] - two[1]) / (2 * STRAIN_INCREMENT)
            _stress(C[0], C[1], C[2], C[3], history[e, p], numbers, state, out)
            B[:] = 0.0
            for s in range(sides):
                for i in range(6):
                    gx, gy = G[e, p, s, i, 0] / sides, G[e, p, s, i, 1] / sides
                    for a in range(2):
                        B[0, 2 * i + a] += F[s, a, 0] * gx
                        B[1, 2 * i + a] += F[s, a, 1] * gy
                        B[2, 2 * i + a] += F[s, a, 0] * gy + F[s, a, 1] * gx
                    for k in range(6):
                        hx, hy = G[e, p, s, k, 0], G[e, p, s, k, 1]
                        g = out[0] * gx * hx + out[1] * gy * hy + out[2] * (gx * hy + gy * hx)
                        for a in range(2):
                            K[e, 2 * i + a, 2 * k + a] += weights[e, p] * g
            if radius[e] < np.inf:
                for i in range(3):
                    B[3, 2 * i] = hoop / (3 * radius[e])
                    for k in range(3):
                        K[e, 2 * i, 2 * k] += weights[e, p] * out[3] / (9 * radius[e] ** 2)
            K[e] += weights[e, p] * (B.T @ D @ B)


@kernel
def applied(x, y, actions, depth, g):
    """Add loads, pressure and shear at the values y of the histories to forces g (n, 2) [N].

    The depth is the thickness of a plane solid [m], and none with axial symmetry.
    """
    loads, sides, stress, of_side = actions
    for q in range(len(loads)):
        for i in range(len(x)):
            g[i, 0] += y[q] * loads[q, i, 0]
            g[i, 1] += y[q] * loads[q, i, 1]
    for k in range(len(sides)):
        i, j = sides[k, 0], sides[k, 1]
        dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
        half = 0.5 * y[of_side[k]]
        half *= depth if depth > 0 else np.pi * (x[i, 0] + x[j, 0])
        fx = half * (stress[k, 1] * dx - stress[k, 0] * dy)
        fy = half * (stress[k, 1] * dy + stress[k, 0] * dx)
        g[i, 0], g[i, 1] = g[i, 0] + fx, g[i, 1] + fy
        g[j, 0], g[j, 1] = g[j, 0] + fx, g[j, 1] + fy


@inner
def _row(times, table, t, y):
    """Values of the histories at a time, straight between corners, into y."""
    k = 0
    while k < len(times) - 2 and t >= times[k + 1]:
        k += 1
    s = min((t - times[k]) / (times[k + 1] - times[k]), 1.0)
    for c in range(len(y)):
        y[c] = (1 - s) * table[k, c] + s * table[k + 1, c]


@inner
def _gap(px, py, faces, begin, end):
    """Distance of a place from a convex tool, negative inside, and the nearest face."""
    gap, face = -np.inf, begin
    for j in range(begin, end):
        d = (px - faces[j, 0]) * faces[j, 4] + (py - faces[j, 1]) * faces[j, 5]
        if d > gap:
            gap, face = d, j
    return gap, face


@inner
def _keep_out(x, v, mass, free, tools, y, before, dt, impulse):
    """Put nodes in tools onto their faces; the impulse has Coulomb's part along the face."""
    faces, first, friction = tools
    at = len(y) - 2 * len(friction)
    for k in range(len(friction)):
        ox, oy = y[at + 2 * k], y[at + 2 * k + 1]
        wx, wy = (ox - before[at + 2 * k]) / dt, (oy - before[at + 2 * k + 1]) / dt
        for i in range(len(x)):
            gap, j = _gap(x[i, 0] - ox, x[i, 1] - oy, faces, first[k], first[k + 1])
            if gap >= 0:
                continue
            normal = -gap / dt  # change of velocity along the outer normal
            slip = (v[i, 0] - wx) * faces[j, 2] + (v[i, 1] - wy) * faces[j, 3]
            along = -min(max(slip, -friction[k] * normal), friction[k] * normal)
            for a in range(2):
                if free[i, a]:
                    change = normal * faces[j, 4 + a] + along * faces[j, 2 + a]
                    v[i, a] += change
                    x[i, a] += dt * change
                    impulse[k, a] += mass[i] * change


@kernel
def fly(x, v, mass, free, parts, numbers, state, speed, acts, times, histories, seen):
    """Central differences; pictures at or just after the times wanted, which become those reached.

    Returns the number of steps, -1 if the motion was lost, and the energy that went into the solid.
    """
    patch, G, weights, radius, area = parts
    corners, table, actions, depth, driven, columns, tools = acts
    path, plastic, tool_forces, reactions = seen
    old, new = histories
    f, g, start = np.zeros(x.shape), np.zeros(x.shape), x.copy()
    impulse = np.zeros(tool_forces[0].shape)
    y, before = np.zeros(table.shape[1]), np.zeros(table.shape[1])
    _row(corners, table, 0.0, before)
    t, dt, steps, shot, spent, since = 0.0, 0.0, 0, 0, 0.0, 0.0
    while True:
        if t >= times[shot]:
            path[shot], plastic[shot], times[shot] = x, old[:, :, 4], t
            tool_forces[shot] = impulse / (t - since) if t > since else impulse
            reactions[shot] = f - g
            impulse[:], since = 0.0, t
            shot += 1
            if shot == len(path):
                return steps, spent
        if steps % 10 == 0:
            dt = COURANT_NUMBER * _shortest(x, patch, area) / speed
            if not dt > 0:
                return -1, spent
        f[:], g[:] = 0.0, 0.0
        forces(x, patch, G, weights, radius, numbers, state, old, f, new)
        applied(x, before, actions, depth, g)
        _row(corners, table, t + dt, y)
        old, new = new, old
        for i in range(len(x)):
            for a in range(2):
                if free[i, a]:
                    was = v[i, a]
                    v[i, a] -= dt * (f[i, a] - g[i, a]) / mass[i]
                    spent += dt * f[i, a] * 0.5 * (was + v[i, a])
                    x[i, a] += dt * v[i, a]
        for k in range(len(driven)):
            i, a = driven[k] // 2, driven[k] % 2
            place = start[i, a] + (y[columns[k]] if columns[k] >= 0 else 0.0)
            was = v[i, a]
            v[i, a] = (place - x[i, a]) / dt
            g[i, a] -= mass[i] * (v[i, a] - was) / dt
            spent += dt * f[i, a] * v[i, a]
            x[i, a] = place
        _keep_out(x, v, mass, free, tools, y, before, dt, impulse)
        before[:] = y
        t += dt
        steps += 1


@inner
def _shortest(x, patch, area):
    """Least height of a triangle whose area does not count as less than its floor."""
    least = np.inf
    for e in range(len(patch)):
        a, b, c = patch[e, 0], patch[e, 1], patch[e, 2]
        ux, uy, vx, vy = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[c, 0] - x[a, 0], x[c, 1] - x[a, 1]
        side = max(ux * ux + uy * uy, vx * vx + vy * vy, (ux - vx) ** 2 + (uy - vy) ** 2)
        twice = max(abs(ux * vy - uy * vx), 2 * MIN_AREA_RATIO * area[e])
        least = min(least, twice / np.sqrt(side))
    return least
