"""Loads spread over a body, reduced once to what a floating frame feels of them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, one_given, typed
from rom.body.flexible import FlexibleBody
from rom.body.surface import Where, chosen_triangles, surface_of
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index


@typed
@dataclass(frozen=True, slots=True)
class SpreadLoad:
    """Forces f on points X + sum_k phi_k q_k of a body, for a unit of their amplitude.

    Attributes:
        force: (3,) sum of f [N].
        first: (3, 3) entry [a, b] is the sum of X_a f_b [N m].
        shapes: (r, 3, 3) entry [k, a, b] is the sum of phi_k,a f_b [N m] per unit of q_k.
    """

    force: Array
    first: Array
    shapes: Array

    def __add__(self, other: "SpreadLoad") -> "SpreadLoad":
        pairs = ((getattr(self, x), getattr(other, x)) for x in ("force", "first", "shapes"))
        return SpreadLoad(*(a + b for a, b in pairs))

    def __rmul__(self, factor: float) -> "SpreadLoad":
        return SpreadLoad(factor * self.force, factor * self.first, factor * self.shapes)


@typed
def surface_load(
    body: FlexibleBody,
    *,
    pressure: float | None = None,
    traction: npt.ArrayLike | None = None,
    forces: npt.ArrayLike | None = None,
    where: Where = None,
) -> SpreadLoad:
    """A load on the outer surface of a body, from the surface it carries.

    Every triangle gives a third of its load to each of its corners, in the undeformed geometry.

    Args:
        body: with a surface.
        pressure: [Pa], pushing inwards; or
        traction: (3,) force per area in the axes of the body [Pa]; or
        forces: (s, 3) forces on the points of ``body.surface`` [N].
        where: which part of the surface: a function of the (t, 3) centres of the triangles that
            returns (t,) booleans, the name of a deformable interface, or None for all of it.

    Raises:
        ConfigError: for not exactly one load, or a place without area.
        ModelError: if the body has no surface, or one whose triangles do not tell inside from
            outside, which a pressure needs.
    """
    one_given("a load", pressure=pressure, traction=traction, forces=forces)
    surface = surface_of(body)
    shapes = surface.shape.reshape(surface.points.shape[0], 3, -1)
    if forces is not None:
        if where is not None:
            raise ConfigError("forces take no `where`; write zeros where there is none.")
        f = finite("forces", forces, surface.points.shape)
        return _reduced(surface.points, shapes, f)
    chosen, areas = chosen_triangles(body, where)
    if pressure is not None:
        _refuse_inside_out(body.name, surface.triangles)
        each = -float(pressure) * areas
    else:
        each = np.linalg.norm(areas, axis=1)[:, None] * finite("traction", traction, (3,))
    f = np.zeros(surface.points.shape)
    np.add.at(f, chosen.ravel(), np.repeat(each / 3, 3, axis=0))
    return _reduced(surface.points, shapes, f)


@typed
def mass_load(body: FlexibleBody, acceleration: npt.ArrayLike) -> SpreadLoad:
    """Force per mass on every particle of a body, such as gravity or a magnetic pull.

    Args:
        body: flexible.
        acceleration: (3,) force per mass [m/s^2].
    """
    g = finite("acceleration", acceleration, (3,))
    shapes = np.einsum("ak,b->kab", body.S, g)
    return SpreadLoad(body.mass * g, np.outer(body.first_moment, g), shapes)


def _reduced(points: Array, shapes: Array, f: Array) -> SpreadLoad:
    both = np.einsum("nak,nb->kab", shapes, f, optimize=True)
    return SpreadLoad(f.sum(axis=0), points.T @ f, both)


def _refuse_inside_out(name: str, triangles: Index) -> None:
    """Every edge of a closed surface is passed once in each direction."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    once, back = (np.unique(x, axis=0) for x in (ends, ends[:, ::-1]))
    if len(once) != len(ends) or not np.array_equal(once, back):
        text = f"the triangles on body {name!r} do not tell its inside from its outside"
        raise ModelError(f"{text}: pressure has no direction; give a traction or forces.")
