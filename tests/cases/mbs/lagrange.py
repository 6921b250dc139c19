"""An independent way to move mechanisms: Lagrange's equations of few coordinates, in SciPy."""

import numpy as np
from scipy.integrate import solve_ivp

STEP = 2e-3  # of second derivatives, as a share of a radian or metre


def jacobian(f, q):
    """(n, k) derivative of f, exact to round-off: a complex step."""
    columns = (f(q + 1e-30j * e).imag / 1e-30 for e in np.eye(q.size))
    return np.column_stack(list(columns))


def bend(f, q, v):
    """(n,) second derivative of f along v, from differences of fourth order."""
    size = np.linalg.norm(v)
    if size == 0.0:
        return np.zeros_like(f(q))
    h = STEP / size
    one, two = (f(q + k * h * v) + f(q - k * h * v) for k in (1, 2))
    return (16 * one - two - 30 * f(q)) / (12 * h**2)


def lagrange(  # noqa: PLR0913  the problem and how to solve it
    points, force, q, v, times, *, closed=None, method="DOP853", rtol=1e-12
):
    """Coordinates and their rates (2 k, n_t) of a mechanism.

    Args:
        points: q -> (n,) with the kinetic energy 1/2 |d points / dt|^2: coordinates of masses times
            the root of the mass, directions times the root of a moment. Takes complex numbers.
        force: (q, v) -> (k,) generalised forces.
        q, v: (k,) coordinates and their rates at the start.
        times: (n_t,).
        closed: q -> (c,) what stays zero where loops are closed.
        method, rtol: of `solve_ivp`.
    """
    k = q.size

    def rhs(_, y):
        q, v = y[:k], y[k:]
        J = jacobian(points, q)
        mass, load = J.T @ J, force(q, v) - J.T @ bend(points, q, v)
        if closed is not None:
            G = jacobian(closed, q)
            zero = np.zeros((G.shape[0],) * 2)
            mass = np.block([[mass, G.T], [G, zero]])
            load = np.concatenate([load, -bend(closed, q, v)])
        return np.concatenate([v, np.linalg.solve(mass, load)[:k]])

    span = (times[0], times[-1])
    run = solve_ivp(rhs, span, np.concatenate([q, v]), method, times, rtol=rtol, atol=1e-12)
    assert run.success, run.message
    return run.y


def potential_force(height):
    """Force of a potential energy q -> number."""

    def force(q, _v):
        return -jacobian(lambda x: np.atleast_1d(height(x)), q)[0]

    return force
