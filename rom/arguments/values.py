"""Checks of values: whole numbers in a range, words of a list, shapes, rotations."""

import math
import operator
import reprlib
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments.quantities import (
    Ascending,
    Between,
    NotNegative,
    Positive,
    Quantity,
    Shape,
    Whole,
)
from rom.errors import ConfigError, QualityGateError, RomError
from rom.names import named
from rom.units import in_si

Array = npt.NDArray[np.float64]  # not from rom.model, whose records are checked here
SHOWN_LENGTH = 60  # letters of a wrong value in a message


def shortened(value: object) -> str:
    """A value in a message, in one line of bearable length."""
    if isinstance(value, np.ndarray) and value.size > 1:
        return f"array of shape {value.shape} and type {value.dtype}"
    try:
        text = " ".join(reprlib.repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= SHOWN_LENGTH else f"{text[: SHOWN_LENGTH - 3]}..."


def plain(name: str, value: object, unit: str) -> Any:
    """Quantities in SI where they are texts such as "210 GPa"; anything else as it is."""
    if isinstance(value, list | tuple) and any(isinstance(x, str | list | tuple) for x in value):
        row = [plain(name, x, unit) for x in value]
        return tuple(row) if isinstance(value, tuple) else row
    try:
        return in_si(value, unit) if isinstance(value, str) else value
    except ConfigError as error:
        error.where = error.where or name
        raise


def whole(name: str, value: Any, low: int = 0, high: int | None = None, *, reason: str = "") -> int:
    """The value as a whole number within a range; a reason for that is the rest of a sentence."""
    kind, fits = Whole(low, high), isinstance(value, Integral) and not isinstance(value, bool)
    if fits and kind.holds(operator.index(value)):
        return operator.index(value)
    why = f": {reason}" if reason else ""
    raise ConfigError(f"{name} = {shortened(value)} must be {kind.words}{why}.")


def lowest(n: int | None) -> slice:
    """Which modes are wanted: the n lowest ones, or all without a number."""
    return slice(None if n is None else whole("n", n))


def vector(
    name: str, value: object, n: int | None = None, *, error: type[RomError] = ConfigError
) -> Array:
    """The value as (n,) finite numbers; without n as any number of them, one number alone too."""
    given = [value] if n is None and np.isscalar(value) else value
    array = finite(name, given, None, error=error)
    if array.ndim != 1 or not array.size or n not in (None, array.size):
        needed = "at least one number" if n is None else f"{n} numbers"
        raise error(f"{name} has shape {array.shape}, needed is a row of {needed}.")
    return array


def matrix(name: str, value: Any, shape: tuple[int | None, int | None] = (None, None)) -> Any:
    """The value as a matrix, sparse or dense, of this shape; None for any length."""
    given = hasattr(value, "dot") and hasattr(value, "dtype")
    found = value if given else finite(name, value, None)
    if len(found.shape) != 2 or found.dtype.kind not in "iuf":
        raise ConfigError(f"{name} = {shortened(value)} must be a matrix of numbers.")
    if not Quantity(shapes=(shape,)).has_shape(found.shape):
        raise ConfigError(f"{name} has shape {found.shape}, needed is {shape_words(shape)}.")
    return found


def symmetric(
    name: str, A: Any, rtol: float, *, where: str = "", error: type[RomError] = QualityGateError
) -> None:
    """Refuse a matrix (n, n), sparse or dense, of a file, that belongs to no energy.

    Round-off is a difference of its halves up to rtol [1] of its largest entry.
    """
    gap, size = (abs(X).max() if A.shape[0] else 0.0 for X in (A - A.T, A))
    if gap > rtol * size:
        raise error(
            f"{name} is not symmetric: its halves differ by {gap / size:.2g} of its largest entry.",
            where=where,
            hint="Look for a block that is transposed or missing; where both halves are meant, "
            "write (A + A.T) / 2.",
        )


def orthonormal(name: str, A: object, *, error: type[RomError] = ConfigError) -> Array:
    """The value as a (3, 3) matrix whose rows are axes: of length one, at right angles."""
    axes = finite(name, A, (3, 3), error=error)
    if not np.allclose(axes @ axes.T, np.eye(3), atol=1e-9):
        raise error(f"{name} = {axes.tolist()} must be a (3, 3) matrix of orthonormal rows.")
    return axes


def check_places(
    name: str, at: npt.ArrayLike, n: int, *, error: type[RomError] = ConfigError
) -> None:
    """Refuse places, counted from 0, that are beyond those of n things."""
    places = np.asarray(at).ravel()
    if beyond := sorted(set(places[(places < 0) | (places >= n)].tolist())):
        raise error(f"{name} {named(beyond)} must be from 0 to {n - 1}.")


def rows_at(name: str, at: object, A: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """(p, k) rows of A (n, k): at places (p,) that count from 0, or combined by (p, n) numbers."""
    wanted, n = finite(name, at, None), A.shape[0]
    if wanted.ndim == 2 and wanted.shape[1] == n and wanted.size:
        return np.asarray(wanted @ A)
    whole_numbers = wanted.ndim == 1 and wanted.size and not (wanted % 1).any()
    if not whole_numbers or wanted.min() < 0 or wanted.max() >= n:
        raise ConfigError(
            f"{name} = {shortened(at)} must be places from 0 to {n - 1}, or rows of {n}."
        )
    return A[wanted.astype(np.int64)]


def is_endless(value: object) -> bool:
    """Whether a value is infinite, and positive."""
    return isinstance(value, Real) and not isinstance(value, bool) and value == math.inf


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is one finite real number; True and False are none."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def one_of(
    name: str, value: object, words: Iterable[str], *, error: type[RomError] = ConfigError
) -> str:
    """The value as one of some words."""
    known = list(words)
    if isinstance(value, str) and value in known:
        return value
    raise error(f"{name} = {shortened(value)} is none of {', '.join(map(repr, known))}.")


def ascending(name: str, value: object, least: int = 2) -> Array:
    """The value as a row of so many finite numbers or more, each above the one before."""
    x = finite(name, value, (None,))
    if fault := Ascending(least=least).fault(x):
        raise ConfigError(name + fault)
    return x


def finite(
    name: str, value: object, shape: Shape | None, *, error: type[RomError] = ConfigError
) -> Array:
    """The value as a float array of this shape; None for any, or for any length."""
    try:
        array = np.array(value, dtype=float)
        numbers = not array.size or np.array(value).dtype.kind in "iuf"
    except (TypeError, ValueError, OverflowError):
        numbers = False
    wanted = "finite numbers" if shape is None else f"shape {shape_words(shape)}"
    if not numbers:
        raise error(f"{name} = {shortened(value)} is not made of numbers, needed is {wanted}.")
    if shape is not None and not Quantity(shapes=(shape,)).has_shape(array.shape):
        raise error(f"{name} has shape {array.shape}, needed is {shape_words(shape)}.")
    if not np.isfinite(array).all():
        raise error(f"{name} = {shortened(array.tolist())} is not finite; give finite numbers.")
    return array


def shape_words(shape: Shape) -> str:
    """A shape as it is written, n for any length."""
    return str(shape).replace("None", "n")


def one_given(of: str, **choices: object) -> None:
    """Refuse anything but one of some arguments, None where they are not given."""
    *most, last = choices
    if sum(x is not None for x in choices.values()) != 1:
        raise ConfigError(f"{of} needs exactly one of {', '.join(most)} and {last}.")


def not_both(of: str, **choices: object) -> None:
    """Refuse two arguments of which one is enough, None where they are not given."""
    if sum(x is not None for x in choices.values()) > 1:
        raise ConfigError(f"{of} takes {' or '.join(choices)}, not both.")


def one_each(
    what: str, given: object, each: str, wanted: object, *, error: type[RomError] = ConfigError
) -> None:
    """Refuse things, by their name in the plural, whose number or shape is not that of others."""
    if given != wanted:
        n, m = (x[0] if isinstance(x, tuple) and len(x) == 1 else x for x in (given, wanted))
        raise error(f"{n} {what} for {m} {each}; give one for each.")


def number(name: str, value: object, *, error: type[RomError] = ConfigError) -> float:
    """The value as a finite float."""
    return float(finite(name, value, (), error=error))


def positive(
    name: str, value: object, *, error: type[RomError] = ConfigError, infinite: bool = False
) -> float:
    """The value as a positive float, finite or, where that is taken, infinite."""
    return _limited(name, value, Positive(infinite=infinite), error)


def not_negative(
    name: str, value: object, *, error: type[RomError] = ConfigError, infinite: bool = False
) -> float:
    """The value as a float of zero or more, finite or, where that is taken, infinite."""
    return _limited(name, value, NotNegative(infinite=infinite), error)


def between(
    name: str,
    value: object,
    low: float,
    high: float,
    ends: str = "[]",
    *,
    error: type[RomError] = ConfigError,
) -> float:
    """The value as a finite float of an interval; round brackets where an end is no part of it."""
    return _limited(name, value, Between(low, high, ends), error)


def _limited(name: str, value: object, kind: Quantity, error: type[RomError]) -> float:
    x = math.inf if kind.infinite and is_endless(value) else number(name, value, error=error)
    if fault := kind.fault(x):
        raise error(name + fault)
    return x


def unit_vector(name: str, value: object) -> Array:
    """The value as a vector of length one."""
    x = finite(name, value, (3,))
    length = np.linalg.norm(x)
    if length == 0.0:
        raise ConfigError(f"{name} has length zero; give a direction, such as (0, 0, 1).")
    return x / length


def matrix33(name: str, value: npt.ArrayLike) -> Array:
    """A (3, 3) matrix from itself or from its diagonal."""
    if np.shape(value) == (3,):
        return np.diag(finite(name, value, (3,)))
    return finite(name, value, (3, 3))


def unit_quaternion(value: Any) -> Array:
    """(4,) unit quaternion from a (3, 3) rotation matrix, a quaternion, or None."""
    if value is None:
        return np.array([1.0, 0.0, 0.0, 0.0])
    if np.shape(value) == (4,):
        p = finite("orientation", value, (4,))
        if abs(np.linalg.norm(p) - 1.0) > 1e-3:
            raise ConfigError(
                f"quaternion {p.tolist()} must have length 1, not {np.linalg.norm(p):.6g}."
            )
        return p / np.linalg.norm(p)
    A = finite("orientation", value, (3, 3))
    error = np.abs(A @ A.T - np.eye(3)).max()
    if error > 1e-3 or np.linalg.det(A) < 0.0:
        raise ConfigError(
            f"orientation must be a rotation: A A^T differs from 1 by {error:.3g}, "
            f"its determinant is {np.linalg.det(A):.6g}."
        )
    U, _, V = np.linalg.svd(A)
    return rotation.quaternion(U @ V)


def start_pose(
    at: object, orientation: object, velocity: object, omega: object
) -> tuple[Array, ...]:
    """(3,) place, (4,) quaternion, (3,) velocity and (3,) angular velocity; None for no motion."""
    zero = np.zeros(3)
    return (
        finite("at", at, (3,)),
        unit_quaternion(orientation),
        finite("velocity", zero if velocity is None else velocity, (3,)),
        finite("omega", zero if omega is None else omega, (3,)),
    )
