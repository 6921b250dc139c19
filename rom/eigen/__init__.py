"""Eigenvalue problems, written on verbs of operators.

`verbs` are what reductions need of K and M, `scipy` does them with SciPy on one process,
`attachments` adds masses and springs at nodes.
"""

from rom.lazy import front

__all__ = [
    "CLUSTER_RTOL",
    "ON_A_LINE",
    "Held",
    "Mass",
    "Operators",
    "Weighted",
    "canonical_signs",
    "count_shift",
    "dofs_of",
    "given_rigid_motions",
    "mac",
    "mean_motion",
    "orthonormal",
    "residual_errors",
    "rigid_motions",
    "whole_clusters",
]
__getattr__ = front(__name__, "verbs", __all__)
