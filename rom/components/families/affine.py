"""A finite element model as a sum of terms, one per region."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.body.inertia import inertia_integrals, weighted
from rom.body.projection import carried_integrals, stress_recovery
from rom.body.recovery import StressRecovery
from rom.components.families.family import Share
from rom.components.families.layers import Stretch
from rom.components.families.parameters import Density, Parameter, Point, factors
from rom.eigen.attachments import added_mass
from rom.eigen.verbs import Operators, own_points
from rom.errors import ParameterError
from rom.model import Array, FEModel, Region
from rom.names import offered
from rom.reduction.full_model import mesh_operators

REMAINDER_RTOL = 1e-12  # share of mass and stiffness below which all belongs to named regions


class AffineModel:
    """A finite element model whose regions have factors of stiffness and density.

    Args:
        model: the model at factors of one.
        parameters: by name.

    Raises:
        ParameterError: if a parameter names a region that the model does not know.
    """

    stretch: Stretch | None = None

    def __init__(self, model: FEModel, parameters: dict[str, Parameter]):
        self.model, self.parameters = model, parameters
        self.ops = mesh_operators(model)
        self.added = added_mass(model, self.ops.first, self.ops.n_local)
        names = dict.fromkeys(p.region for p in parameters.values() if p.region is not None)
        for name in names:
            if name not in model.regions:
                raise ParameterError(
                    f"there is no region {name!r}; the model has {offered(model.regions, name)}.",
                    hint="Regions are the named physical volumes of the geometry.",
                )
        self.regions = {name: model.regions[name] for name in names}

    @property
    def moving(self) -> list[str]:
        """Parameters that change shapes: not those that multiply all of K, or all of M."""
        return [
            name
            for name, p in self.parameters.items()
            if p.region is not None or (isinstance(p, Density) and self.added is not None)
        ]

    def model_at(self, point: Point) -> FEModel:
        """Points and interfaces at some factors."""
        return self.model

    def rigid_samples(self) -> Iterator[tuple[Operators, FEModel]]:
        """Models whose rigid motions the basis needs besides those of the centre."""
        return iter(())

    def kinds(self, interfaces: dict[str, Any]) -> dict[str, Any]:
        """Kinds of the interfaces whose coordinates are the same at all factors."""
        return interfaces

    def terms(self, body: FlexibleBody, E: Array) -> dict[str, Any]:
        """Fields of the family that differ from one kind of model to the other.

        Args:
            body: the body at the centre of the ranges.
            E: (n_local, r) its shapes.
        """
        stress = body.stress.operator if isinstance(body.stress, StressRecovery) else None
        return {"body": body, "shares": tuple(self.shares(E, stress))}

    def bare(self, point: Point) -> Operators:
        """The model at some factors, without what interfaces carry."""
        k, m = factors(self.parameters, (None, *self.regions), point)
        if (k == 1).all() and (m == 1).all():
            return self.ops
        parts = self.regions.values()
        K = [(c - k[0], part.K) for c, part in zip(k[1:], parts, strict=True) if c != k[0]]
        M = [(c - m[0], part.M) for c, part in zip(m[1:], parts, strict=True) if c != m[0]]
        return self.ops.varied((k[0], K), (m[0], M))

    def at(self, point: Point) -> Operators:
        """The model at some factors with all it carries."""
        ops = self.bare(point)
        return ops if self.added is None else ops.plus_mass(self.added)

    def shares(self, E: Array, stress: Array | None) -> Iterator[Share]:
        """The terms in the coordinates of the shapes.

        Args:
            E: (n_local, r) shapes.
            stress: (6 p, r) stress on the surface at factors of one [Pa], or None.
        """
        ops = self.ops
        K, points = symmetric(ops.gram(E, ops.apply_K(E))), own_points(ops, self.model.points)
        remainder = inertia_integrals(ops, points, E)
        mass, stiffness = remainder.mass, np.trace(K)
        for name, region in self.regions.items():
            integrals = inertia_integrals(ops, points, E, region.M)
            share = Share(
                name,
                integrals,
                symmetric(ops.gram(E, ops.product(region.K, E))),
                None if stress is None else self._stress(region, E),
            )
            yield share
            remainder, K = weighted(np.array([1, -1]), [remainder, integrals]), K - share.K
            stress = None if stress is None else stress - share.stress
        if remainder.mass > REMAINDER_RTOL * mass or np.trace(K) > REMAINDER_RTOL * stiffness:
            yield Share(None, remainder, K, stress)
        if carried := carried_integrals(self.model, ops, E):
            together = weighted(np.ones(len(carried)), carried)
            yield Share(None, together, np.zeros_like(K), fixed=True)

    def _stress(self, region: Region, E: Array) -> Array:
        return stress_recovery(replace(self.model, stresses=region.stresses), E).operator


def symmetric(A: Array) -> Array:
    """(A + A^T) / 2."""
    return 0.5 * (A + A.T)
