"""Checks of values: whole numbers in a range, words of a list, shapes, rotations."""

import math
import operator
import reprlib
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.errors import ConfigError, RomError

Array = npt.NDArray[np.float64]  # not from rom.model, whose records are checked here
SHOWN_LENGTH = 60  # letters of a wrong value in a message


def shortened(value: Any) -> str:
    """A value in a message, in one line of bearable length."""
    if isinstance(value, np.ndarray) and value.size > 1:
        return f"array of shape {value.shape} and type {value.dtype}"
    try:
        text = " ".join(reprlib.repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= SHOWN_LENGTH else f"{text[: SHOWN_LENGTH - 3]}..."


def whole(name: str, value: Any, low: int = 0, high: int | None = None, *, reason: str = "") -> int:
    """The value as a whole number within a range.

    Args:
        name: of the argument.
        value: what was given.
        low: smallest that is allowed.
        high: largest that is allowed; None for no limit.
        reason: why there is such a range, as the rest of a sentence.

    Raises:
        ConfigError: for anything else; 3.0 is not a whole number.
    """
    fits = isinstance(value, Integral) and not isinstance(value, bool)
    if fits and low <= operator.index(value) and (high is None or operator.index(value) <= high):
        return operator.index(value)
    span = f"of {low} or more" if high is None else f"from {low} to {high}"
    why = f": {reason}" if reason else ""
    raise ConfigError(f"{name} = {shortened(value)} must be a whole number {span}{why}.")


def lowest(n: int | None) -> slice:
    """Which modes are wanted: the n lowest ones, or all without a number.

    Raises:
        ConfigError: for a number below zero.
    """
    return slice(None if n is None else whole("n", n))


def vector(name: str, value: Any, n: int | None = None) -> Array:
    """The value as (n,) finite numbers; without n as any number of them, one number alone too.

    Raises:
        ConfigError: for another shape, or entries that are not finite numbers.
    """
    array = finite(name, [value] if n is None and np.isscalar(value) else value, None)
    if array.ndim != 1 or not array.size or n not in (None, array.size):
        needed = "at least one number" if n is None else f"{n} numbers"
        raise ConfigError(f"{name} has shape {array.shape}, needed is a row of {needed}.")
    return array


def matrix(name: str, value: Any, shape: tuple[int | None, int | None] = (None, None)) -> Any:
    """The value as a matrix, sparse or dense, of this shape; None for any length.

    Raises:
        ConfigError: for anything else.
    """
    given = hasattr(value, "dot") and hasattr(value, "dtype")
    found = value if given else finite(name, value, None)
    if len(found.shape) != 2 or found.dtype.kind not in "iuf":
        raise ConfigError(f"{name} = {shortened(value)} must be a matrix of numbers.")
    if any(n not in (None, size) for n, size in zip(shape, found.shape, strict=True)):
        raise ConfigError(f"{name} has shape {found.shape}, needed is {shape}.")
    return found


def rows_at(name: str, at: Any, A: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """(p, k) rows of A (n, k): at places (p,) that count from 0, or combined by (p, n) numbers.

    Raises:
        ConfigError: for places beyond the rows, or numbers that do not fit them.
    """
    wanted, n = finite(name, at, None), A.shape[0]
    if wanted.ndim == 2 and wanted.shape[1] == n and wanted.size:
        return np.asarray(wanted @ A)
    whole_numbers = wanted.ndim == 1 and wanted.size and not (wanted % 1).any()
    if not whole_numbers or wanted.min() < 0 or wanted.max() >= n:
        raise ConfigError(
            f"{name} = {shortened(at)} must be places from 0 to {n - 1}, or rows of {n}."
        )
    return A[wanted.astype(np.int64)]


def is_number(value: Any) -> bool:
    """Whether a value is one finite real number; True and False are none."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def one_of(
    name: str, value: Any, words: Iterable[str], *, error: type[RomError] = ConfigError
) -> str:
    """The value as one of some words.

    Raises:
        RomError: listing them, of the class ``error``.
    """
    known = list(words)
    if isinstance(value, str) and value in known:
        return value
    raise error(f"{name} = {shortened(value)} is none of {', '.join(map(repr, known))}.")


def finite(name: str, value: Any, shape: tuple[int, ...] | None) -> Array:
    """The value as a float array of this shape; None for any.

    Raises:
        ConfigError: for another shape, or entries that are not finite numbers.
    """
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ConfigError(f"{name} = {shortened(value)} is not made of numbers.") from error
    if np.array(value).dtype.kind not in "iuf" and array.size:
        raise ConfigError(f"{name} = {shortened(value)} is not made of numbers.")
    if shape is not None and array.shape != shape:
        raise ConfigError(f"{name} has shape {array.shape}, needed is {shape}.")
    if not np.isfinite(array).all():
        raise ConfigError(f"{name} = {shortened(array.tolist())} is not finite.")
    return array


def number(name: str, value: Any) -> float:
    """The value as a finite float."""
    return float(finite(name, value, ()))


def positive(name: str, value: Any) -> float:
    """The value as a finite positive float."""
    x = number(name, value)
    if x <= 0.0:
        raise ConfigError(f"{name} = {x:g} must be positive.")
    return x


def unit_vector(name: str, value: Any) -> Array:
    """The value as a vector of length one."""
    x = finite(name, value, (3,))
    length = np.linalg.norm(x)
    if length == 0.0:
        raise ConfigError(f"{name} has length zero: it gives no direction.")
    return x / length


def matrix33(name: str, value: Any) -> Array:
    """A (3, 3) matrix from itself or from its diagonal."""
    if np.shape(value) == (3,):
        return np.diag(finite(name, value, (3,)))
    return finite(name, value, (3, 3))


def unit_quaternion(value: Any) -> Array:
    """(4,) unit quaternion from a (3, 3) rotation matrix, a quaternion, or None.

    Raises:
        ConfigError: if it is farther than 1e-3 from a rotation.
    """
    if value is None:
        return np.array([1.0, 0.0, 0.0, 0.0])
    if np.shape(value) == (4,):
        p = finite("orientation", value, (4,))
        if abs(np.linalg.norm(p) - 1.0) > 1e-3:
            raise ConfigError(f"quaternion {p.tolist()} has length {np.linalg.norm(p):.6g}, not 1.")
        return p / np.linalg.norm(p)
    A = finite("orientation", value, (3, 3))
    error = np.abs(A @ A.T - np.eye(3)).max()
    if error > 1e-3 or np.linalg.det(A) < 0.0:
        raise ConfigError(
            f"orientation is not a rotation: A A^T differs from 1 by {error:.3g}, "
            f"its determinant is {np.linalg.det(A):.6g}."
        )
    U, _, V = np.linalg.svd(A)
    return rotation.quaternion(U @ V)


def start_pose(at: Any, orientation: Any, velocity: Any, omega: Any) -> tuple[Array, ...]:
    """(3,) place, (4,) quaternion, (3,) velocity and (3,) angular velocity; None for no motion."""
    zero = np.zeros(3)
    return (
        finite("at", at, (3,)),
        unit_quaternion(orientation),
        finite("velocity", zero if velocity is None else velocity, (3,)),
        finite("omega", zero if omega is None else omega, (3,)),
    )
