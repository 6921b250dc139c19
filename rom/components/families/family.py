"""A family of flexible bodies: one basis, and every matrix a sum of terms with known factors.

The stiffness of a solid is linear in the moduli of its regions, its mass and all inertia integrals
in their densities::

    K(p) = sum_i k_i(p) K_i,   M(p) = sum_i m_i(p) M_i

so that a body at other parameters is a sum of small matrices. The rigid motions of the shapes are
the same everywhere; the floating frame, which depends on the mass, is made anew at each point.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.body.damping import ModalDamping, Rayleigh, damped
from rom.body.flexible import FlexibleBody
from rom.body.frame import reference_label
from rom.body.inertia import InertiaIntegrals, fields_of, weighted
from rom.body.recovery import StressRecovery
from rom.components.families.layers import Stretch, stretched_body
from rom.components.families.parameters import (
    Parameter,
    Point,
    Thickness,
    centre,
    complete,
    factor,
    factors,
)
from rom.eigen.supports import Fixed, Springs
from rom.model import Array, Report


@dataclass(frozen=True, slots=True)
class Share:
    """What one region gives to a body whose parameters are one."""

    region: str | None  # its name; None for all that no parameter names
    integrals: InertiaIntegrals  # of its mass
    K: Array  # (r, r) its stiffness [N/m]; with layers (3, 6 + r, 6 + r), see `Stretch`
    stress: Array | None = None  # (6 p, r) that it carries [Pa], see `StressRecovery`; None without
    fixed: bool = False  # True for masses that no parameter scales


@typed
@dataclass(frozen=True)
class BodyFamily:
    """A flexible body with parameters; `at` gives the body for their values.

    Attributes:
        body: its shapes, markers and surface, at the centre of the ranges; coordinates as in the
            shares.
        parameters: by name.
        shares: the terms of stiffness and mass.
        reference: how the floating frame of the bodies follows them, see
            `FlexibleBody.with_reference`.
        damping: of the bodies, or None.
        provenance: how the family was made.
        certificate: evidence that its bodies stand for full models, or None.
        stretch: layers whose thickness is a parameter, or None. Points of the body are nominal
            ones then, and the shares know [fields of the layers, rigid motions, shapes].
    """

    body: FlexibleBody
    parameters: dict[str, Parameter]
    shares: tuple[Share, ...]
    reference: object = "mean-axis"
    damping: Rayleigh | ModalDamping | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    certificate: Report | None = None
    stretch: Stretch | None = None

    def at(self, *, extrapolate: bool = False, **values: float) -> FlexibleBody:
        """The body for some values of the parameters; no finite elements involved.

        Args:
            extrapolate: warn about factors outside their range instead of refusing them.
            values: name=factor; one for those not given.

        Raises:
            ParameterError: if a name is unknown, or a factor outside its range.
        """
        point = complete(self.parameters, values, extrapolate=extrapolate)
        body = self._summed(point).with_reference(self.reference)
        return body if self.damping is None else damped(body, self.damping)

    def frequencies(
        self,
        n: int | None = None,
        *,
        fixed: Fixed = (),
        springs: Springs | None = None,
        extrapolate: bool = False,
        **values: float,
    ) -> Array:
        """(k,) natural frequencies [Hz] at some values, without the rest of the body.

        Args:
            n: how many, lowest first; None for all.
            fixed: what is held, see `FlexibleBody.frequencies`.
            springs: {interface: stiffness to the ground}, likewise.
            extrapolate: see `at`.
            values: see `at` [1].

        Raises:
            ParameterError, InterfaceError: see `at` and `FlexibleBody.frequencies`.
        """
        point = complete(self.parameters, values, extrapolate=extrapolate)
        return self._summed(point, fields=False).frequencies(n, fixed=fixed, springs=springs)

    def with_reference(self, reference: object) -> "BodyFamily":
        """The same family seen from another floating frame.

        Raises:
            ConfigError, InterfaceError, ModelError: see `FlexibleBody.with_reference`.
        """
        self._summed(centre(self.parameters)).with_reference(reference)
        return replace(self, reference=reference)

    def _summed(self, point: Point, *, fields: bool = True) -> FlexibleBody:
        """The sum of the terms, in the coordinates of the shares."""
        regions = tuple(share.region for share in self.shares)
        k, m = factors(self.parameters, regions, point)
        m[[share.fixed for share in self.shares]] = 1.0
        made: dict[str, Any] = {"provenance": self.provenance | {"parameters": point}}
        made["certificate"] = self.certificate
        if self.stretch is not None:
            return replace(self._stretched(self.stretch, point, (k, m)), **made)
        integrals = weighted(m, [share.integrals for share in self.shares])
        stress = self.body.stress
        if stress is not None and fields:
            parts = [share.stress for share in self.shares]
            stress = StressRecovery(stress.points, _sum(k, parts))
        K = _sum(k, [share.K for share in self.shares])
        return replace(self.body, **fields_of(integrals), K=K, stress=stress, **made)

    def _stretched(
        self, stretch: Stretch, point: Point, factors: tuple[Array, Array]
    ) -> FlexibleBody:
        middle = centre(self.parameters)
        t = [factor(self.parameters, Thickness, share.region, point) for share in self.shares]
        terms = [share.integrals for share in self.shares], [share.K for share in self.shares]
        w, at_centre = (stretch.weights(self.parameters, p) for p in (point, middle))
        return stretched_body(self.body, stretch, terms, (*factors, np.array(t)), (w, at_centre))

    def __str__(self) -> str:
        frame, each = reference_label(self.reference), self.parameters.items()
        head = f"{self.body.name}: {self.body.n_modes} elastic coordinates, {frame} frame"
        ranges = [f"{name}: {p} times {p.low:g} to {p.high:g}" for name, p in each]
        return "\n  ".join([head, *ranges])


def _sum(weights: Array, parts: list[Array | None]) -> Array:
    """Weighted sum of the parts that exist."""
    terms = [w * A for w, A in zip(weights, parts, strict=True) if A is not None]
    return np.sum(terms, axis=0)
