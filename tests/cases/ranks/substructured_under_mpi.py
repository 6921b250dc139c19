"""Under mpirun: `substructured_under_mpi.py main RESULT` writes as JSON how far the factor that
ranks share is from dense solutions, and which matrices it refuses; `reduced RESULT` a body."""

import json
import sys
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.sparse import csr_matrix, diags, identity, kron, random

import rom
from cases.solid import STEEL
from rom.fe.operators.aij import aij
from rom.fe.operators.solver import DIRECT_SOLVER, Solver
from rom.fe.operators.substructures import shared
from rom.fe.operators.substructures.shared import divided, substructured

COMM = MPI.COMM_WORLD
BORDERS = {"whole": shared.WholeBorder, "shared": shared.Border}


def chain(n, width, rng):
    """Dofs in rows of some width, three to a node, stiff only to their neighbours."""
    line = diags([-1.0, 2.1, -1.0], [-1, 0, 1], shape=(n, n))
    across = random(width, width, 0.2, random_state=rng)
    node = rng.standard_normal((3, 3))
    return kron(
        kron(line, identity(width) + 0.05 * (across + across.T)), node @ node.T + 3.0 * np.eye(3)
    )


def distributed(K, block_size=3):
    """The rows of this rank, whole nodes, more on the last ones."""
    n = K.shape[0]
    nodes = np.array([n // block_size * k * (k + 1) // (COMM.size * (COMM.size + 1))
                      for k in range(COMM.size + 1)])  # fmt: skip
    first, end = block_size * nodes[COMM.rank], block_size * nodes[COMM.rank + 1]
    local = end - first
    return aij(csr_matrix(K)[first:end], ((local, n), (local, n)), COMM, block_size), first, end


def error(K, A, first, end, rng, kind):
    """Of forty solutions, over the largest."""
    F = rng.standard_normal((K.shape[0], 40))
    factor = substructured(A, DIRECT_SOLVER)
    if factor is None or not factor.ok or not isinstance(factor.border, kind):
        return None
    exact = np.linalg.solve(K.toarray(), F)
    X = factor.solve(np.asfortranarray(F[first:end]))
    x, b = A.createVecs()
    b.array[:] = F[first:end, 0]
    factor.apply(b, x)
    factor.release()
    gap = max(np.abs(X - exact[first:end]).max(), np.abs(x.array - exact[first:end, 0]).max())
    return COMM.allreduce(gap, op=MPI.MAX) / np.abs(exact).max()


def joined(A):
    """Entries between the insides of different ranks, of which there must be none."""
    split, (first, _) = divided(A), A.getOwnershipRange()
    inside = np.concatenate(COMM.allgather(first + split.inside))
    owner = np.repeat(np.arange(COMM.size), COMM.allgather(split.inside.size))
    starts, columns, values = A.getValuesCSR()
    rows = csr_matrix((values, columns, starts), shape=(starts.size - 1, A.getSize()[1]))
    return int(COMM.allreduce(rows[split.inside][:, inside[owner != COMM.rank]].nnz))


def one_way(n):
    """Nodes in a line, stiff to the ground, that only their first dofs join."""
    line = diags([-1.0, -1.0], [-1, 1], shape=(n, n))
    return csr_matrix(kron(line, diags([1.0, 0.0, 0.0])) + 3.0 * identity(3 * n))


def star(first):
    """Dofs in a line; the last of a rank is joined to ten of the next."""
    n = 30 * COMM.size * (COMM.size + 1) // 2
    K = diags([-1.0, 30.0, -1.0], [-1, 0, 1], shape=(n, n)).tolil()
    for end in first[1:]:
        K[end - 1, end : end + 10] = K[end : end + 10, end - 1] = 1.0
    return K.tocsr()


def costly(first):
    """Each of fifty dofs joined to one of the next rank: a border as large as an inside."""
    n = 60 * COMM.size * (COMM.size + 1) // 2
    K = 30.0 * identity(n, format="lil")
    for here, there in pairwise(first):
        for k in range(50):
            K[here + k, there + k] = K[there + k, here + k] = 1.0
    return K.tocsr()


class Starved(shared.Inside):
    """MUMPS finds on the last rank that its work space does not suffice."""

    def factor(self):
        S = super().factor()
        self.code = -9 if COMM.rank == COMM.size - 1 else self.code
        return S


def without_memory(A, name):
    """Whether MUMPS over ranks is left to say how much memory is needed."""
    kept = shared.allowed_bytes, shared.Inside
    if name == "no room":
        shared.allowed_bytes = lambda comm: 1e3
    else:
        shared.Inside = Starved
    answer = substructured(A, DIRECT_SOLVER)
    shared.allowed_bytes, shared.Inside = kept
    return answer is None


def refused(K):
    """Whether a matrix that is not positive definite is said to be none, or answers show it."""
    A, first, end = distributed(csr_matrix(K))
    factor = substructured(A, DIRECT_SOLVER)
    if not factor.ok:
        return True
    X = factor.solve(np.asfortranarray(np.eye(K.shape[0])[first:end, :12]))
    return not COMM.allreduce(np.abs(X).max(), op=MPI.MAX) < 1e10


@contextmanager
def border(kind):
    """Whatever it costs, factored by every rank or by all together."""
    kept, sign = shared.border_seconds, 1 if kind == "whole" else -1
    shared.border_seconds = lambda flops, entries, ranks=1: sign * ranks
    yield
    shared.border_seconds = kept


def main(path):
    rng = np.random.default_rng(3)
    found = {"errors": [], "joined": [], "definite": []}
    cases = [(3, chain(40, 4, rng)), (3, chain(40, 9, rng)), (1, chain(40, 4, rng))]
    for block_size, K in (*cases, (1, chain(40, 2, rng)), (3, one_way(60))):
        A, first, end = distributed(csr_matrix(K), block_size)
        found["joined"].append(joined(A))
        for kind in BORDERS:
            with border(kind):
                found["errors"].append(error(csr_matrix(K), A, first, end, rng, BORDERS[kind]))
    A, *_ = distributed(star([0] * COMM.size), 1)
    A, *_ = distributed(star(A.getOwnershipRanges()[:-1]), 1)
    found["border of stars"] = divided(A).K_border.shape[0]
    A, *_ = distributed(costly([0] * COMM.size), 1)
    A, *_ = distributed(costly(A.getOwnershipRanges()[:-1]), 1)
    found["costly"] = substructured(A, DIRECT_SOLVER) is None
    K = csr_matrix(chain(40, 4, rng))
    A, *_ = distributed(K)
    for name, solver in (
        ("on disk", Solver(out_of_core=True)),
        ("low rank", Solver(low_rank=1e-8)),
    ):
        found[name] = substructured(A, solver) is None
    for name in ("no room", "room runs out"):
        found[name] = without_memory(A, name)
    found["full"] = (
        substructured(distributed(csr_matrix(np.ones((60, 60))))[0], DIRECT_SOLVER) is None
    )
    apart = csr_matrix(kron(identity(COMM.size * (COMM.size + 1) // 2), chain(8, 2, rng)))
    found["apart"] = substructured(distributed(apart)[0], DIRECT_SOLVER) is None
    loose = diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(40, 40)).tolil()
    loose[0, 0] = loose[-1, -1] = 1.0  # free at both ends
    empty = K.tolil()
    empty[7, :] = empty[:, 7] = 0.0
    for kind in BORDERS:
        with border(kind):
            for matrix in (kron(loose, np.eye(6)), -K, empty):  # neither is positive definite
                found["definite"].append(not refused(matrix))
    if COMM.rank == 0:
        Path(path).write_text(json.dumps(found))


def reduced(path):
    """A beam whose substructures share the factor of their border, and how often they did."""
    made, shared.MAX_BORDER_RATIO = [], np.inf
    sizes = {"L": 1.0, "b": 0.11, "h": 0.07, "lc": 0.07}
    model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=sizes, solver="direct")
    options = {"reference": "root", "certify": False}
    with border("shared"):
        shared.Border.factor = counted(shared.Border.factor, made)
        kinds = {"root": "rbe2", "tip": "rbe3"}
        body = rom.reduce(model, method=rom.CraigBampton(6), interfaces=kinds, **options)
        held = rom.modes(model, 3, fixed=("root",))
    out = {"K": body.K, "M": body.M, "omega": body.omega, "surface": body.surface.shape}
    shapes = model.operators.rows(held.shapes, model.interfaces["tip"].dofs)
    if COMM.rank == 0:
        np.savez(path, factors=len(made), full=held.frequencies, modes=shapes, **out)


def counted(factor, made):
    return lambda *arguments: made.append(1) or factor(*arguments)


if __name__ == "__main__":
    {"main": main, "reduced": reduced}[sys.argv[1]](sys.argv[2])
