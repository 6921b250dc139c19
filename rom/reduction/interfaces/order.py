"""The order of interface polynomials: the lowest with which a band is accurate."""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rom.eigen.verbs import Held, Operators, residual_errors
from rom.errors import ConfigError, SolverError
from rom.model import Array, FEModel
from rom.reduction.bases.fixed_interface import projected
from rom.reduction.bases.method import CraigBampton
from rom.reduction.bases.selection import BAND_FACTOR, SAFETY_FACTOR, reduced_modes
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.kinds import parsed
from rom.reduction.interfaces.polynomial import Polynomial

log = logging.getLogger("rom")
MAX_ORDER = 10  # beyond it, all dofs of an interface are the better choice
SHIFT_RATIO = 0.02  # of the first elastic eigenvalue: makes the stiffness of a free body definite


def open_orders(interfaces: dict[str, Any]) -> list[str]:
    """Names of the interfaces {name: kind} whose polynomials have no order yet."""
    return [name for name, kind in interfaces.items() if parsed(name, kind) == Polynomial()]


def with_orders(
    ops: Operators, model: FEModel, interfaces: dict[str, Any], method: Any
) -> tuple[dict[str, Any], Any]:
    """Interfaces whose order was left open, with the lowest order that is accurate enough.

    The reduced modes of the free body leave a residual in the model whose surfaces keep all dofs;
    it measures what modes and surfaces miss together. Half of the tolerance goes to the modes, in
    the method returned beside the interfaces {name: kind}.
    """
    open_ = open_orders(interfaces)
    if not isinstance(method, CraigBampton) or method.f_max is None or method.tol is None:
        text = f"the order of the polynomials on {open_} is open, and {method} states no accuracy."
        raise ConfigError(text, hint="Give one, or reduce with CraigBampton(f_max=…, tol=…).")
    error = _error_in_band(ops, connect(ops, model, interfaces | dict.fromkeys(open_, "full")).ops)
    half, found = replace(method, tol=0.5 * method.tol), np.inf
    for order in range(1, MAX_ORDER + 1):
        kinds = interfaces | dict.fromkeys(open_, Polynomial(order))
        connection = connect(ops, model, kinds)
        basis = half.basis(connection.ops, connection.boundary, connection.labels)
        found = error(connection.ops.expand(basis.Psi), 2 * np.pi * method.f_max)
        say = log.info if ops.first == 0 else log.debug
        say("polynomials of order %d: estimated error %.1e", order, found)
        if found <= method.tol:
            return kinds, half
    text = f"polynomials of order {MAX_ORDER} on {open_} leave an estimated error of {found:.1e}"
    hint = f'Use "full" on these interfaces, or a larger tolerance than {method.tol:g}.'
    raise SolverError(f"{text} up to {method.f_max:g} Hz.", hint=hint)


def _error_in_band(ops: Operators, full: Operators) -> Callable[[Array, float], float]:
    """The largest estimated frequency error of a basis up to omega_max, see `residual_errors`."""
    inverse: list[Held] = []

    def error(Psi: Array, omega_max: float) -> float:
        K, M = projected(ops, Psi)
        lam, V = reduced_modes(K, M)
        elastic = lam > 1e-9 * lam[-1]
        lam, V = lam[elastic], V[:, elastic]
        if not inverse:  # one factor serves all orders
            inverse.append(full.hold(np.zeros(0, dtype=np.int64), -SHIFT_RATIO * lam[0]))
        near = int(np.searchsorted(lam, (BAND_FACTOR * omega_max) ** 2))
        eta = residual_errors(ops, inverse[0], Psi @ V[:, :near], seen_in=full)
        inside = lam[:near] <= (1 + 4 * eta) * omega_max**2  # the exact one may be
        return SAFETY_FACTOR * float(eta[inside].max(initial=0.0))

    return error
