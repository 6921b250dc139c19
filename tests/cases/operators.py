"""Operators of both implementations."""

import pytest
from scipy.sparse import csr_matrix

from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import rigid_motions


def _rigid(model):
    """Without points there is no geometry."""
    return None if model.points is None else rigid_motions(model.points)


def scipy_operators(model):
    return SciPyOperators(model.K, model.M, _rigid(model))


def petsc_operators(model):
    pytest.importorskip("petsc4py", reason="PETSc is not installed")
    from petsc4py import PETSc

    from rom.fe.operators.petsc import PETScOperators

    def aij(A):
        A = csr_matrix(A)
        return PETSc.Mat().createAIJ(A.shape, csr=(A.indptr, A.indices, A.data))

    return PETScOperators(aij(model.K), aij(model.M), _rigid(model))


KINDS = [
    pytest.param(scipy_operators, id="scipy"),
    pytest.param(petsc_operators, id="petsc", marks=pytest.mark.fenicsx),
]
