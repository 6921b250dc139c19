"""A finite element model as a sum of terms, one per region, whose thickness may change too."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import identity, kron

from rom.body.flexible import FlexibleBody
from rom.body.inertia import inertia_integrals, weighted
from rom.body.projection import carried_integrals, stress_recovery
from rom.body.recovery import StressRecovery
from rom.components.families.family import Share
from rom.components.families.layers import Stretch
from rom.components.families.parameters import (
    Density,
    Parameter,
    Point,
    Thickness,
    centre,
    factor,
    factors,
)
from rom.eigen.attachments import added_mass
from rom.eigen.verbs import Operators, orthonormal_in, own_points, rigid_motions
from rom.errors import ModelError, ParameterError
from rom.model import Array, FEModel, Interface, Layered, refuse_springs
from rom.names import check_known
from rom.reduction.full_model import mesh_operators
from rom.reduction.interfaces.characteristic import GivenFunctions

REMAINDER_RTOL = 1e-12  # share of mass and stiffness below which all belongs to named regions
OVERLAP_RTOL = 1e-6  # of the extent, by which regions may overlap along the axis
OUTSIDE_RTOL = 1e-9  # share of mass and stiffness that may lie outside all regions, of layers
ARM_RTOL = 1e-9  # of the extent: round-off of the arms of rotations
RIGID_RTOL = 1e-6  # distance of rigid motions from the basis that is still accepted


class AffineModel:
    """A finite element model whose regions have factors of stiffness and density."""

    stretch: Stretch | None = None

    def __init__(self, model: FEModel, parameters: dict[str, Parameter]):
        self.model, self.parameters = model, parameters
        self.ops = mesh_operators(model)
        self.added = added_mass(model, self.ops.first, self.ops.n_local)
        for whole in (p for p in parameters.values() if not (p.region or isinstance(p, Density))):
            refuse_springs(model, f"the factor of {whole} is of elements alone; name a region")
        names = dict.fromkeys(p.region for p in parameters.values() if p.region is not None)
        for name in names:
            text = f"there is no region {name!r}, a named physical volume; the model has"
            check_known(name, model.regions, text, ParameterError)
        self.regions = {name: model.regions[name] for name in names}

    @property
    def moving(self) -> list[str]:
        """Parameters that change shapes: not those that multiply all of K, or all of M."""
        carries, each = self.added is not None, self.parameters.items()
        return [n for n, p in each if p.region or (isinstance(p, Density) and carries)]

    def model_at(self, point: Point) -> FEModel:
        """Points and interfaces at some factors."""
        return self.model

    def rigid_samples(self) -> Iterator[tuple[Operators, FEModel]]:
        """Models whose rigid motions the basis needs besides those of the centre."""
        return iter(())

    def kinds(self, interfaces: dict[str, Any]) -> dict[str, object]:
        """Kinds of the interfaces whose coordinates are the same at all factors."""
        return interfaces

    def terms(
        self, body: FlexibleBody, E: Array
    ) -> tuple[FlexibleBody, tuple[Share, ...], Stretch | None]:
        """Body, shares and layers of the family, at the centre of the ranges, by (n_local, r)."""
        stress = body.stress.operator if isinstance(body.stress, StressRecovery) else None
        return body, tuple(self.shares(E, stress)), None

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
        """The terms by shapes (n_local, r), with stress (6 p, r) on the surface [Pa], or None."""
        ops = self.ops
        K, points = symmetric(ops.gram(E, ops.apply_K(E))), own_points(ops, self.model.points)
        remainder = inertia_integrals(ops, points, E)
        mass, stiffness = remainder.mass, np.trace(K)
        for name, region in self.regions.items():
            integrals = inertia_integrals(ops, points, E, region.M)
            own = symmetric(ops.gram(E, ops.product(region.K, E)))
            carried_stress = None
            if stress is not None:
                alone = replace(self.model, stresses=region.stresses)
                carried_stress = stress_recovery(alone, E).operator
                stress = stress - carried_stress
            yield Share(name, integrals, own, carried_stress)
            remainder, K = weighted(np.array([1, -1]), [remainder, integrals]), K - own
        if remainder.mass > REMAINDER_RTOL * mass or np.trace(K) > REMAINDER_RTOL * stiffness:
            yield Share(None, remainder, K, stress)
        if carried := carried_integrals(self.model, ops, E):
            together = weighted(np.ones(len(carried)), carried)
            yield Share(None, together, np.zeros_like(K), fixed=True)


def symmetric(A: Array) -> Array:
    """(A + A^T) / 2."""
    return 0.5 * (A + A.T)


class StretchedModel(AffineModel):
    """A model whose regions have factors of thickness besides those of the material.

    All its regions are terms, each with three parts of the stiffness, see `rom.model.Layered`.
    """

    def __init__(self, model: FEModel, parameters: dict[str, Parameter]):
        super().__init__(model, parameters)
        if model.attachments:
            raise ParameterError("a model with a parameter of thickness takes no attached masses.")
        refuse_springs(model, "a parameter of thickness moves elements alone")
        thin = [p for p in parameters.values() if isinstance(p, Thickness)]
        axis = "xyz".index(thin[0].axis)
        self.regions = dict(model.regions)
        if not self.regions or any(part.stretched is None for part in self.regions.values()):
            text = "the regions of the model do not tell how they are stretched"
            raise ParameterError(f"{text}; models of rom.fe do.")
        self.layered: dict[str, Layered] = {n: r.stretched(axis) for n, r in self.regions.items()}
        names = tuple(dict.fromkeys(p.region for p in thin if p.region is not None))
        for name in names:
            self._refuse_neighbours(name, float(np.ptp(model.points[:, axis])))
        self.stretch = Stretch(axis, names, tuple(self.layered[name].layers for name in names))

    def _refuse_neighbours(self, name: str, extent: float) -> None:
        for other, layered in self.layered.items():
            for low, high in layered.layers if other != name else ():
                for a, b in self.layered[name].layers:
                    if min(b, high) - max(a, low) > OVERLAP_RTOL * extent:
                        text = f"region {name!r} is no layer of its own: {other!r} lies beside it"
                        where = f"from {max(a, low):g} to {min(b, high):g} m"
                        hint = "Choose another axis, or change both with one parameter."
                        raise ParameterError(f"{text} {where}.", hint=hint)

    @property
    def moving(self) -> list[str]:
        """Parameters that change shapes."""
        thick = [n for n, p in self.parameters.items() if isinstance(p, Thickness)]
        return list(dict.fromkeys([*super().moving, *thick]))

    def model_at(self, point: Point) -> FEModel:
        """Points and interfaces at some factors."""
        return self._moved(self.stretch.weights(self.parameters, point))

    def rigid_samples(self) -> Iterator[tuple[Operators, FEModel]]:
        """Models whose rigid motions together span those of every field."""
        nominal = np.ones(2 + len(self.stretch.regions))
        for w in (nominal, *(nominal + e for e in np.eye(nominal.size)[1:])):
            moved = self._moved(w)
            rigid = rigid_motions(own_points(self.ops, moved.points))
            yield self.ops.varied((1.0, []), (1.0, []), rigid), moved

    def _moved(self, w: Array) -> FEModel:
        """The model with its fields weighted."""

        def face(nominal: Interface) -> Interface:
            origin = self.stretch.mapped(nominal.origin[None], w)[0]
            points = self.stretch.mapped(nominal.points, w)
            return replace(nominal, points=points, origin=origin, axis=None)

        faces = {name: face(nominal) for name, nominal in self.model.interfaces.items()}
        points = self.stretch.mapped(self.model.points, w)
        return replace(self.model, points=points, interfaces=faces)

    def kinds(self, interfaces: dict[str, Any]) -> dict[str, object]:
        """All motions that are rigid at some thickness, for interfaces that are rigid."""
        for name, kind in interfaces.items():
            if not isinstance(kind, str) or kind != "rbe2":
                text = f"interface {name!r} has the kind {kind!r}"
                raise ParameterError(f'{text}; with a parameter of thickness it must be "rbe2".')
        faces = self.model.interfaces
        return {n: self._functions(faces[n]) if n in faces else "rbe2" for n in interfaces}

    def _functions(self, face: Interface) -> GivenFunctions:
        """Orthonormal; rotations of every field on their own."""
        motions = np.hstack(self.stretch.motions(face.points))
        size = np.linalg.norm(motions, axis=0)
        real = size > ARM_RTOL * np.ptp(self.model.points) * size[0]  # a face at x = 1e-17 has none
        S = kron(face.surface_mass, identity(3), format="csr")
        return GivenFunctions(orthonormal_in(S, motions[:, real]))

    def bare(self, point: Point) -> Operators:
        """The model at some factors."""
        k, m = factors(self.parameters, tuple(self.regions), point)
        t = [factor(self.parameters, Thickness, name, point) for name in self.regions]
        K, M = [], []
        for i, (name, region) in enumerate(self.regions.items()):
            parts = self.layered[name]
            K += [(k[i] * t[i], parts.K_along), (k[i], parts.K_mixed)]
            K.append((k[i] / t[i], parts.K_across))
            M.append((m[i] * t[i], region.M))
        points = own_points(self.ops, self.model_at(point).points)
        return self.ops.varied((0.0, K), (0.0, M), rigid_motions(points))

    def terms(
        self, body: FlexibleBody, E: Array
    ) -> tuple[FlexibleBody, tuple[Share, ...], Stretch | None]:
        """The body at nominal points, shares and layers."""
        points, middle = own_points(self.ops, self.model.points), self.bare(centre(self.parameters))
        X = self.stretch.fields(points)
        Phi = np.hstack([middle.rigid, E])
        columns = np.hstack([X.reshape(len(X), -1).T, Phi])
        shares = []
        for name, region in self.regions.items():
            parts = self.layered[name]
            matrices = (parts.K_along, parts.K_mixed, parts.K_across)
            K = [symmetric(self.ops.gram(Phi, self.ops.product(A, Phi))) for A in matrices]
            integrals = inertia_integrals(self.ops, points, columns, region.M)
            shares.append(Share(name, integrals, np.array(K)))
        self._refuse_more(E, shares)
        rigid = np.array([self._coefficients(middle, Phi, R) for R in self.stretch.motions(points)])
        markers = {
            n: replace(m, point=self.model.interfaces[n].origin, patch=None, kind="rbe2")
            for n, m in body.markers.items()
        }
        surface = body.surface
        if surface is not None:
            surface = replace(surface, points=self.model.points[self.model.surface.nodes])
        body = replace(body, markers=markers, surface=surface)
        return body, tuple(shares), replace(self.stretch, rigid=rigid)

    def _coefficients(self, ops: Operators, Phi: Array, R: Array) -> Array:
        """(6 + r, 6) combinations of Phi that give the rigid motions of one field."""
        MPhi = ops.apply_M(Phi)
        M = ops.gram(Phi, MPhi)
        scale = 1 / np.sqrt(np.diag(M))
        C = np.linalg.solve(scale[:, None] * M * scale, scale[:, None] * ops.gram(MPhi, R))
        C = scale[:, None] * C
        gap, size = (
            np.sqrt(np.diag(ops.gram(A, ops.apply_M(A))).max()) for A in (R - Phi @ C, ops.rigid)
        )
        if gap > RIGID_RTOL * size:
            text = f"the basis misses a rigid motion of a stretched body by {gap:.1e}"
            raise ModelError(f"{text}; ask for more modes, or a narrower range of the thickness.")
        return C

    def _refuse_more(self, E: Array, shares: list[Share]) -> None:
        """All elements must belong to a region."""
        ops, first = self.ops, -E.shape[1]
        K = sum(np.trace(share.K.sum(axis=0)[first:, first:]) for share in shares)
        M = sum(np.einsum("aakk->k", s.integrals.S_kl)[first:].sum() for s in shares)
        for A, found in ((ops.apply_K(E), K), (ops.apply_M(E), M)):
            whole = np.trace(ops.gram(E, A))
            if abs(whole - found) > OUTSIDE_RTOL * whole:
                text = f"the regions {sorted(self.regions)} are not the whole model"
                raise ParameterError(f"{text}, whose thickness is to change; name all of them.")
