"""MUMPS without PETSc, for a solution in two halves with the Schur complement of a border between.

PETSc does not pass these halves on. What calls MUMPS is compiled once, as forms are.
"""

import hashlib
import weakref
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mpi4py import MPI

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, tril, triu

from rom.fe.jit import compiling, usable_cache
from rom.fe.operators.foreseen import counted_entries
from rom.fe.parallel import on_root
from rom.model import Array, Index
from rom.process.memory import mapped_files

C_DECLARATIONS = """
typedef int... MUMPS_INT;
typedef int... MUMPS_INT8;
typedef struct {
    MUMPS_INT sym, par, job, comm_fortran, n, nrhs, lrhs, lredrhs, size_schur;
    MUMPS_INT8 nnz, nnz_loc;
    MUMPS_INT icntl[...], infog[...];
    MUMPS_INT *irn, *jcn, *irn_loc, *jcn_loc, *perm_in, *sym_perm, *listvar_schur;
    double rinfog[...];
    double *a, *a_loc, *rhs, *redrhs, *schur;
    char version_number[...];
    ...;
} DMUMPS_STRUC_C;
const char *header_version(void);
void dmumps_c(DMUMPS_STRUC_C *);
int64_t rerooted(int32_t, const int64_t *, const int32_t *, int32_t, int32_t *);
"""
HEADER_LINES = """
#include <dmumps_c.h>
static const char *header_version(void) { return MUMPS_VERSION; }
"""
SOURCE_FILE = Path(__file__).with_name("rerooted.c")
START_JOB, END_JOB, ANALYSIS_JOB, FACTOR_JOB, SOLUTION_JOB = -1, -2, 1, 2, 3
DEFINITE_KIND = 1  # SYM: positive definite, no pivoting
NO_WORDS = ((1, -1), (2, -1), (3, -1), (4, 0))  # ICNTL: no words
ORDER_GIVEN, COMPLEMENT_WHOLE, ENTRIES_ON_RANKS = (7, 1), (19, 1), (18, 3)  # ICNTL
FIRST_HALF, SECOND_HALF = 1, 2  # ICNTL(26): the halves of a solution


def library(comm: MPI.Comm) -> Any:
    """The compiled module with `ffi` and `lib`, which calls the MUMPS of PETSc.

    None where that is no library of its own, where its header is not installed or of another
    version, or where a rank does not see what rank 0 has compiled. All ranks must call.
    """
    files = [path for path in mapped_files() if "libdmumps" in path]
    path: Any
    with compiling(comm):
        path = on_root(comm, _compiled, files[0] if len(files) == 1 else "")
    if not comm.allreduce(path is not None and path.exists(), op=MPI.LAND):
        return None
    module = _loaded(path)
    return module if comm.allreduce(_fits(module), op=MPI.LAND) else None


def _loaded(path: Path) -> Any:
    name = path.name.partition(".")[0]
    spec = spec_from_loader(name, ExtensionFileLoader(name, str(path)))
    module = module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(module)  # type: ignore[union-attr]
    return module


def _compiled(mumps: str) -> Path | None:
    """The file of the module for this library, compiled now if it is not there."""
    try:
        from cffi import FFI, VerificationError
    except ImportError:
        return None
    source = HEADER_LINES + SOURCE_FILE.read_text()
    digest = hashlib.sha256((C_DECLARATIONS + source + mumps).encode()).hexdigest()
    name, folder = f"rom_mumps_{digest[:16]}", usable_cache()
    found = sorted(folder.glob(f"{name}.*.so"))
    if found or not mumps:
        return found[0] if mumps else None
    ffi = FFI()
    ffi.cdef(C_DECLARATIONS)
    ffi.set_source(name, source, extra_compile_args=["-O2"], extra_link_args=[mumps])
    with TemporaryDirectory(dir=folder) as scratch:
        try:
            made = Path(ffi.compile(tmpdir=scratch))
        except VerificationError:
            return None
        return made.replace(folder / made.name)


def _fits(module: Any) -> bool:
    """Whether the library has the version of the header; tried in more memory than it says."""
    ffi, kind = module.ffi, "DMUMPS_STRUC_C"
    memory = ffi.new("char[]", 2 * ffi.sizeof(kind))
    data = ffi.cast(f"{kind} *", memory)
    data.sym, data.par, data.comm_fortran = DEFINITE_KIND, 1, MPI.COMM_SELF.py2f()
    data.job = START_JOB
    module.lib.dmumps_c(data)
    for number, value in NO_WORDS:
        data.icntl[number - 1] = value
    _end(module.lib.dmumps_c, data)
    return bool(ffi.string(data.version_number) == ffi.string(module.lib.header_version()))


class _Instance:
    """One triangle of a positive definite matrix (n, n) in MUMPS, by one rank or by those of comm.

    With the module of `library` and (number, value) of ICNTL. ``code`` is INFOG(1) of the last
    step, negative where that failed.
    """

    def __init__(
        self, module: Any, n: int, *options: tuple[int, int], comm: MPI.Comm = MPI.COMM_SELF
    ):
        self.ffi, self._call, self.n = module.ffi, module.lib.dmumps_c, n
        self.integer = np.dtype(f"i{self.ffi.sizeof('MUMPS_INT')}")
        self._id = self.ffi.new("DMUMPS_STRUC_C *")
        self._id.sym, self._id.par, self._id.comm_fortran = DEFINITE_KIND, 1, comm.py2f()
        self._arrays: dict[str, Array | Index] = {}
        self._run(START_JOB)
        self._ending: Any = weakref.finalize(self, _end, self._call, self._id)
        for number, value in (*NO_WORDS, *options):
            self._set(number, value)
        self._id.n = n

    def release(self) -> None:
        """Give the memory back."""
        self._ending()

    def give_entries(self, row: Index, column: Index, here: str = "") -> None:
        """Let MUMPS use where entries are, of the whole matrix or ("_loc") those of this rank."""
        setattr(self._id, f"nnz{here}", row.size)
        self._give_numbers(f"irn{here}", row)
        self._give_numbers(f"jcn{here}", column)

    def _set(self, number: int, value: int) -> None:
        self._id.icntl[number - 1] = value

    def _give_numbers(self, name: str, numbers: Index) -> None:
        """Let MUMPS use numbers, which it counts from one."""
        self._give(name, (numbers + 1).astype(self.integer), "MUMPS_INT *")

    def _give(self, name: str, values: Array | Index, kind: str) -> None:
        """Let MUMPS use an array, which lives until another takes its place."""
        self._arrays[name] = values
        setattr(self._id, name, self.ffi.cast(kind, values.ctypes.data))

    def order(self) -> Index | None:
        """(n,) place of each unknown in the order of elimination that MUMPS chooses."""
        self._run(ANALYSIS_JOB)
        if self.code < 0:
            return None
        size = self.n * self.ffi.sizeof("MUMPS_INT")
        numbers = np.frombuffer(self.ffi.buffer(self._id.sym_perm, size), dtype=self.integer)
        return numbers.astype(np.int64) - 1

    def _foresee(self) -> None:
        """What the factorisation will take, by the analysis: of all ranks, and of the largest."""
        self._run(ANALYSIS_JOB)
        self.flops, self.entries = self._id.rinfog[0], counted_entries(self._id.infog[2])
        self.bytes = 1e6 * self._id.infog[15]

    def _run(self, job: int) -> None:
        self._id.job = job
        self._call(self._id)
        self.code = int(self._id.infog[0])


def _end(call: Any, data: Any) -> None:
    if not MPI.Is_finalized():
        data.job = END_JOB
        call(data)


def elimination_order(module: Any, pattern: csr_matrix, n_last: int) -> Index | None:
    """(n,) place of each unknown in an order of little fill with the last n_last at its end.

    The order is the one MUMPS finds for itself; changing its end to these unknowns, which become a
    clique, costs no more fill. An order made for the others alone knows nothing of what they then
    carry along: twice the flops. The pattern (n, n) has the entries of both triangles; None where
    MUMPS finds no order or memory does not suffice.
    """
    n, ffi = pattern.shape[0], module.ffi
    end = np.arange(n - n_last, n)
    clique = [np.tile(end, n_last), np.repeat(end, n_last)]
    whole = pattern + coo_matrix((np.ones(n_last**2), clique), shape=(n, n))
    upper = triu(whole, format="coo")
    graph = _Instance(module, n)
    graph.give_entries(upper.row, upper.col)
    found = graph.order()
    graph.release()
    if found is None:
        return None
    order = np.argsort(found).astype(np.int32)
    whole = csr_matrix(whole)
    start, neighbour = whole.indptr.astype(np.int64), whole.indices.astype(np.int32)
    pointers = (ffi.from_buffer("int64_t[]", start), ffi.from_buffer("int32_t[]", neighbour))
    entries = module.lib.rerooted(n, *pointers, n_last, ffi.from_buffer("int32_t[]", order))
    places = np.empty(n, dtype=np.int64)
    places[order] = np.arange(n)
    return places if entries >= 0 else None


class Inside(_Instance):
    """Factor of the stiffness of an inside, and the Schur complement that its border feels.

    K (n, n) has the entries [K_ii, K_ib; ., 0], of K_ii the upper triangle only; the m unknowns of
    the border are the last ones, places (n,) those in the order of elimination. Foreseen are the
    ``bytes`` the factor will take and the ``flops`` of the factorisation.
    """

    def __init__(self, module: Any, K: coo_matrix, m: int, places: Index):
        super().__init__(module, K.shape[0], ORDER_GIVEN, COMPLEMENT_WHOLE)
        self.give_entries(K.row, K.col)
        self._give("a", K.data, "double *")
        self.m, self._id.size_schur = m, m
        self._give_numbers("listvar_schur", np.arange(self.n - m, self.n))
        self._give_numbers("perm_in", places)
        self._foresee()

    def factor(self) -> Array:
        """Factor; (m, m) lower triangle of the Schur complement -K_bi K_ii^-1 K_ib."""
        S = np.zeros((self.m, self.m))
        self._give("schur", S, "double *")
        self._run(FACTOR_JOB)
        for name in ("irn", "jcn", "a"):  # the solution does not look at them
            setattr(self._id, name, self.ffi.NULL)
            del self._arrays[name]
        return S

    def reduced(self, F: Array) -> tuple[Array, Array]:
        """(n, k) forward substitution of (n - m, k) loads, and (m, k) -K_bi K_ii^-1 F."""
        X, R = (np.zeros((rows, F.shape[1]), order="F") for rows in (self.n, self.m))
        X[: self.n - self.m] = F
        self._solve(FIRST_HALF, X, R)
        return X, R

    def expanded(self, X: Array, U: Array) -> Array:
        """(n - m, k) solution for (m, k) displacements of the border; X is spent."""
        self._solve(SECOND_HALF, X, np.asfortranarray(U))
        return X[: self.n - self.m]

    def _solve(self, half: int, X: Array, R: Array) -> None:
        self._id.nrhs, self._id.lrhs, self._id.lredrhs = X.shape[1], self.n, self.m
        self._set(26, half)
        self._set(27, X.shape[1])  # all columns at once
        self._give("rhs", X, "double *")
        self._give("redrhs", R, "double *")
        self._run(SOLUTION_JOB)


class Border(_Instance):
    """Factor of the Schur complement (m, m) of all insides, over the ranks.

    Each rank gives the lower triangle of what its inside adds at the places ``touched`` (t,), and
    of its rows ``K`` (m, m) of the border itself; equal entries are summed. Analysed are nodes.
    """

    last = 0  # number of the last one, the same on all of its ranks

    def __init__(self, module: Any, K: csr_matrix, touched: Index, comm: MPI.Comm, block_size: int):
        by_nodes, own_comm = (15, -block_size if block_size > 1 else 0), comm.Dup()
        super().__init__(module, K.shape[0], ENTRIES_ON_RANKS, by_nodes, comm=own_comm)
        self._ending.detach()
        Border.last = comm.allreduce(Border.last, op=MPI.MAX) + 1
        kept = (own_comm, self._call, self._id)
        self._ending = weakref.finalize(self, _let_go.__setitem__, Border.last, kept)
        self.comm, own = comm, tril(K, format="coo")
        self._own, (row, column) = own.data, np.tril_indices(touched.size)
        rows, columns = (touched[row], own.row), (touched[column], own.col)
        self.give_entries(np.concatenate(rows), np.concatenate(columns), "_loc")
        self._foresee()
        self.bytes += 24.0 * touched.size**2  # complement, triangle and where its entries are

    def factor(self, complement: Array) -> bool:
        """Factor, with (t, t) of which the lower triangle is read; whether it is definite."""
        values = np.concatenate([complement[np.tril_indices(len(complement))], self._own])
        self._give("a_loc", values, "double *")
        self._run(FACTOR_JOB)
        for name in ("irn_loc", "jcn_loc", "a_loc"):
            setattr(self._id, name, self.ffi.NULL)
            del self._arrays[name]
        return self.code >= 0 and self._id.infog[11] == 0

    def solve(self, loads: Array) -> Array:
        """(m, k) solution for the sum of the loads (m, k) of all ranks, which are spent."""
        X = np.asfortranarray(loads)
        self.comm.Allreduce(MPI.IN_PLACE, X)
        self._id.nrhs, self._id.lrhs = X.shape[1], self.n
        self._set(27, X.shape[1])
        self._give("rhs", X, "double *")
        self._run(SOLUTION_JOB)
        self.comm.Bcast(X)
        return X

    def release(self) -> None:
        """Give the memory back, on all ranks together."""
        self._ending()
        end_together(self.comm)


_let_go: dict[int, tuple[MPI.Comm, Any, Any]] = {}  # by number, what is not yet ended


def end_together(comm: MPI.Comm) -> None:
    """End what each of these ranks has let go, some earlier than others: MUMPS waits for all."""
    mine = {number for number, kept in _let_go.items() if kept[0].size == comm.size}
    for number in sorted(set.intersection(*comm.allgather(mine))):
        own, call, data = _let_go.pop(number)
        _end(call, data)
        own.Free()
