"""Modes of the body in one support alone: what assumed modes were before substructuring."""

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from rom.arguments import Count, typed, whole
from rom.eigen.supports import Fixed, refuse_loose
from rom.eigen.verbs import Operators, given_rigid_motions, orthonormal
from rom.errors import ConfigError
from rom.model import Array, Basis, Index
from rom.reduction.bases.fixed_interface import numbered
from rom.reduction.bases.free_interface import FreeFree
from rom.reduction.bases.method import lowest_modes

MEAN_AXES = ("mean-axis", "buckens", "free")  # no point of the body is held by these
ALIGNED_RTOL = 1e-9  # of a chord that lies along an axis


@typed
@dataclass(frozen=True, slots=True)
class AssumedModes:
    """The lowest modes of the body under a reference condition, and no static shapes.

    Every shape obeys the condition: it vanishes where the body is clamped, carries no moment where
    it is pinned. In a mechanism such shapes do well where joints hold the body as the condition
    does, and converge slowly, or not at all, where they hold it otherwise.

    Attributes:
        n_modes: number of modes; a repeated frequency is kept whole.
        fixed: what the modes obey, as in `rom.modes`, e.g. {"root": "xyz"}. None: the ``reference``
            of `rom.reduce`: clamped at an interface, simply supported at two, free with mean axes.
        held: dofs that are zero, which `rom.reduce` fills in.

    Source:
        O'Shea, Jayakumar, Mechergui, Shabana and Wang, J. Comput. Nonlinear Dynam. 13 (2018)
        041007.

    Example:
        >>> rom.AssumedModes(8, fixed={"root": "xyz rx", "tip": "yz"})  # pinned at both ends
        AssumedModes(n_modes=8, fixed={'root': 'xyz rx', 'tip': 'yz'})
    """

    n_modes: Annotated[int, Count(1)]
    fixed: Fixed | None = None
    held: Index | None = field(default=None, repr=False, compare=False)

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """Rigid motions, then the modes; no column for the interface dofs (n_b,).

        Raises:
            ConfigError: for more modes than there are dofs.
            InterfaceError: if what is held leaves a rigid motion free.
        """
        if self.held is None or not self.held.size:
            return FreeFree(self.n_modes).basis(ops, boundary, labels)
        refuse_loose(ops, self.held)
        R = orthonormal(ops, given_rigid_motions(ops))
        support = ops.hold(self.held)
        whole("n_modes", self.n_modes, 0, support.n_free, reason="the dofs that supports leave")
        omega, Phi = lowest_modes(ops, support, self.n_modes)
        names = [*numbered("rigid", R.shape[1]), *numbered("assumed", omega.size)]
        return Basis(np.hstack([R, Phi]), omega, tuple(names))


def supported_by(reference: Any, origins: dict[str, Array]) -> Fixed:
    """What a reference condition holds: nothing, an interface, or a chord along an axis."""
    if isinstance(reference, str):
        return () if reference in MEAN_AXES else (reference,)
    if len(reference) == 2 and set(reference) <= set(origins):
        first, second = reference
        chord = np.abs(origins[second] - origins[first])
        k = int(np.argmax(chord))
        if np.delete(chord, k).max() <= ALIGNED_RTOL * chord[k]:
            along = "xyz"[k]
            return {first: f"xyz r{along}", second: "xyz".replace(along, "")}
    text = f"reference = {reference!r} does not say what the modes obey, as one interface does."
    raise ConfigError(text, hint='Say it by fixed=, as in {"root": "xyz rx", "tip": "yz"}.')
