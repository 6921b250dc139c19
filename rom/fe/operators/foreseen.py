"""What a factor will take, known from its analysis, and the way to solve that fits into that."""

from dataclasses import dataclass, replace
from typing import Any

from petsc4py import PETSc

import numpy as np

from rom.errors import ResourceError
from rom.fe.operators.disk import free_disk_bytes, scratch_folder
from rom.fe.operators.memory import MAX_MEMORY_SHARE, allowed_bytes, factor_bytes, give_back
from rom.fe.operators.solver import DIRECT_SOLVER, Solver

TAKEN_RATIO = 0.88  # measured over INFOG(17), whose reserve for pivots no definite matrix needs
MAX_BLOCK_RATIO = 2.0  # of any shape and ordering over `factor_bytes`; measured: 0.3 to 1.3
ENTRY_BYTES = 12.0  # value and column of a sparse matrix
SEARCH_COLUMNS = 220  # measured for twenty modes: Lanczos space, its inertia, blocks solved for
N_MATRICES = 3  # K and M off the interfaces, and K - sigma M for the count
MULTIGRID_RATIO = 4.0  # coarse matrices, prolongations and their making over K
ANALYSIS_ONLY = 1  # MB of work space with which MUMPS stops after the analysis
# nodes that share a cell with one inside a mesh, itself included, on average: by degree, from one
COUPLED_NODES = {"tetrahedron": (15, 28, 46), "hexahedron": (27, 64, 125)}
LARGEST_INDEX = int(np.iinfo(PETSc.IntType).max)  # of rows, and of entries on one rank
TOTAL_MEMORY = {"plain": (17, 27), "low-rank": (37, 39)}  # INFOG of MUMPS, in core and out [MB]


@dataclass(frozen=True, slots=True)
class Foreseen:
    """What a factor will take, on all ranks together [bytes]."""

    in_core: float
    out_of_core: float  # memory when the factor is on disk
    on_disk: float


def by_mumps(pc: PETSc.PC, A: PETSc.Mat, solver: Solver) -> PETSc.Mat:
    """The factor L D L^T of A that a preconditioner will have made, not yet analysed."""
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    A.setOption(PETSc.Mat.Option.SPD, False)  # MUMPS then factors an indefinite one, too
    pc.setType(PETSc.PC.Type.CHOLESKY)
    pc.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
    pc.setFactorSetUpSolverType()
    factor = pc.getFactorMatrix()
    if solver.low_rank:
        factor.setMumpsIcntl(35, 1)
        factor.setMumpsCntl(7, solver.low_rank)
    return factor


def analysed(A: PETSc.Mat, solver: Solver = DIRECT_SOLVER) -> Foreseen:
    """What a factor of A will take, by the symbolic analysis of MUMPS: a tenth of a factorisation.

    Within a tenth of what was measured for blocks, rods and plates of 13 725 to 259 917 dofs.
    """
    pc = PETSc.PC().create(A.comm)
    pc.setOperators(A)
    factor = by_mumps(pc, A, solver)
    factor.setMumpsIcntl(23, ANALYSIS_ONLY)
    pc.setUp()
    in_core, out_of_core = TOTAL_MEMORY["low-rank" if solver.low_rank else "plain"]
    found = Foreseen(
        TAKEN_RATIO * 1e6 * factor.getMumpsInfog(in_core),
        TAKEN_RATIO * 1e6 * factor.getMumpsInfog(out_of_core),
        8.0 * entry_count(factor),
    )
    pc.destroy()
    factor.destroy()
    give_back()
    return found


def entry_count(factor: PETSc.Mat) -> float:
    """Entries of a factor, from its analysis."""
    return counted_entries(factor.getMumpsInfog(3))


def counted_entries(number: int) -> float:
    """INFOG(3) of MUMPS, which counts large numbers of entries in millions, below zero."""
    return float(number if number >= 0 else -1e6 * number)


def beside_factor(A: PETSc.Mat, n_columns: int, n_matrices: int) -> float:
    """Memory of dense columns and copies of the matrix A [bytes], on all ranks together."""
    n = A.getSize()[0]
    return ENTRY_BYTES * n_matrices * stored_entries(A) + 8.0 * n * (SEARCH_COLUMNS + n_columns)


def multigrid_bytes(A: PETSc.Mat) -> float:
    """Memory of multigrid for A [bytes], on all ranks together."""
    return MULTIGRID_RATIO * ENTRY_BYTES * stored_entries(A)


def check_indices(n_dofs: int, n_entries: int) -> None:
    """Refuse more dofs, or entries of a matrix on one rank, than PETSc can count."""
    for count, what in ((n_dofs, "dofs"), (n_entries, "entries of the stiffness on one rank")):
        if count > LARGEST_INDEX:
            raise ResourceError(
                f"{count} {what} are foreseen; {LARGEST_INDEX} is the largest index of this PETSc.",
                hint="Use a coarser mesh, more ranks where one has too many entries, or dolfinx on "
                "a PETSc with 64-bit indices (Debian: python3-petsc4py-64-real).",
            )


def check_factor_memory(A: PETSc.Mat, n_columns: int, solver: Solver) -> None:
    """Refuse a factorisation that would not fit beside so many dense columns of its length.

    Where even the factor of a block with as many dofs fits twice, nothing is analysed.
    """
    n, comm = A.getSize()[0], A.comm.tompi4py()
    there, beside = allowed_bytes(comm) * comm.size, beside_factor(A, n_columns, 1)
    if MAX_BLOCK_RATIO * factor_bytes(n) + beside <= there:
        return
    found = analysed(A, solver)
    need = beside + (found.out_of_core if solver.out_of_core else found.in_core)
    if need > there:
        raise too_large(n, need, there)


def automatic(ops: Any) -> tuple[Solver, str]:
    """The first of direct, out-of-core and iterative that fits, and why, in words."""
    K, comm = ops.K, ops.comm
    there, beside = allowed_bytes(comm) * comm.size, beside_factor(K, 0, N_MATRICES)
    if MAX_BLOCK_RATIO * factor_bytes(ops.n) + beside <= there:
        return DIRECT_SOLVER, "direct"
    found, disk = analysed(K), free_disk_bytes(comm)
    direct, by_disk, by_iteration = (
        beside + more for more in (found.in_core, found.out_of_core, multigrid_bytes(K))
    )
    limit = f"{_gib(there)} may be used"
    on_disk = f"{_gib(by_disk)} with {_gib(found.on_disk)} on disk"
    if direct <= there:
        return DIRECT_SOLVER, f"direct: {_gib(direct)} foreseen, {limit}"
    beyond = f"a factor in memory would take {_gib(direct)}, {limit}"
    if by_disk <= there and found.on_disk <= disk:
        return replace(DIRECT_SOLVER, out_of_core=True), f"out-of-core, {on_disk}: {beyond}"
    if by_iteration <= there:
        return Solver(iterative=True), f"iterative, {_gib(by_iteration)}: {beyond}; {on_disk}"
    raise ResourceError(
        f"reducing {ops.n} dofs is predicted to take {_gib(direct)} with the factor in memory, "
        f"{on_disk} ({_gib(disk)} are free in {scratch_folder()}), {_gib(by_iteration)} without "
        f"one; {limit} ({MAX_MEMORY_SHARE:.0%} of what is free).",
        hint="Use a coarser mesh, or more machines with mpirun, which share the model.",
    )


def too_large(n: int, need: float, there: float) -> ResourceError:
    """The error that says by how much a factor of n dofs does not fit."""
    return ResourceError(
        f"factoring {n} dofs is predicted to take {_gib(need)}; "
        f"{_gib(there)} may be used ({MAX_MEMORY_SHARE:.0%} of what is free).",
        hint='Use a coarser mesh, more machines, solver="out-of-core" (the factor on disk) or '
        'solver="iterative" (no factor).',
    )


def stored_entries(A: PETSc.Mat) -> float:
    """Number of entries on all ranks."""
    return float(A.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"])


def _gib(size: float) -> str:
    return f"{size / 2**30:.2f} GiB"
