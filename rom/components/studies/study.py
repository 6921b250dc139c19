"""A study: a measure at many samples of its parameters, and what that tells.

See docs/theory/studies.md.
"""

import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from rom import __version__
from rom.arguments import Count, NotNegative, typed
from rom.components.studies.journal import Journal, Row, packed, read, unpacked
from rom.components.studies.running import Limits, answers, here, processes
from rom.components.studies.worker import Answer
from rom.errors import ConfigError, InterruptedRun, warn
from rom.model import Array, Index
from rom.names import check_known
from rom.process.child import scratch
from rom.process.progress import Progress, looked_for
from rom.process.spreading import sent

if TYPE_CHECKING:
    from rom.components.studies.described import MotionOf

BYTES_PER_GIGABYTE = 2**30
MOST_TOLD = 3  # failures that a report names


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured at each sample.

    Attributes:
        parameters: {parameter: (n,) values}.
        values: {what was measured: (n, ...)}, NaN in the rows of samples that failed.
        failed: {sample: class of the error, and its text}.
        warned: {sample: what was warned of}.
        seconds: (n,) that each sample took [s].
    """

    parameters: dict[str, Array]
    values: dict[str, Array]
    failed: dict[int, str]
    warned: dict[int, list[str]]
    seconds: Array

    def __repr__(self) -> str:
        n, names = len(self.seconds), ", ".join(map(repr, self.values))
        bad = f", {len(self.failed)} failed" if self.failed else ""
        return f"Study({n} samples of {len(self.parameters)} parameters: {names}{bad})"

    @property
    def good(self) -> Index:
        """(m,) numbers of the samples that did not fail."""
        return np.setdiff1d(np.arange(len(self.seconds)), list(self.failed))

    @property
    def table(self) -> Any:
        """Parameters, numbers and failures by sample: a DataFrame, or without pandas a dict."""
        numbers = {name: x for name, x in self.values.items() if x.ndim == 1}
        failed = [self.failed.get(k, "") for k in range(len(self.seconds))]
        columns = {**self.parameters, **numbers, "failed": np.array(failed)}
        try:
            import pandas as pd
        except ModuleNotFoundError:
            return columns
        return pd.DataFrame(columns).rename_axis("sample")

    def to_xarray(self, clock: str = "t") -> Any:
        """All of it as a Dataset by sample, histories by a clock that all samples share.

        Raises:
            ModuleNotFoundError: without xarray.
        """
        import xarray as xr

        found: dict[str, Any] = {name: ("sample", x) for name, x in self.parameters.items()}
        coordinates: dict[str, Any] = {"sample": np.arange(len(self.seconds))}
        times = self._clock(clock)
        if times is not None:
            coordinates[clock] = times
        for name, x in self.values.items():
            own = (f"{name}_{k}" for k in range(x.ndim - 1))
            dims = [clock if times is not None and m == times.size else d
                    for m, d in zip(x.shape[1:], own, strict=True)]  # fmt: skip
            found |= {name: (("sample", *dims), x)} if name not in coordinates else {}
        return xr.Dataset(found, coordinates)

    def on_clock(self, name: str, clock: str = "t") -> Array:
        """Times (n_t,) at which the histories of a value were taken in all samples alike."""
        x, times = self._value(name), self._clock(clock)
        if times is None or x.shape[1:] != times.shape:
            raise ConfigError(f"{name!r} is no history by times {clock!r} that all samples share.")
        return times

    def _clock(self, clock: str) -> Array | None:
        times = self.values[clock][self.good] if clock in self.values else np.zeros(0)
        return times[0] if times.ndim == 2 and (times == times[:1]).all() else None

    def quantiles(
        self, name: str, shares: Sequence[float] = (0.05, 0.5, 0.95), level: float = 0.95
    ) -> tuple[Array, Array]:
        """Quantiles (q, ...) of a value, and the ends (q, 2, ...) between which they lie.

        The ends are order statistics, right for every distribution; infinite where the samples are
        too few to say.

        Source:
            Conover, Practical nonparametric statistics, 1999, section 3.2.
        """
        from scipy.stats import binom

        x = np.sort(self._value(name)[self.good], axis=0)
        n, tail = len(x), (1 - level) / 2
        if not n:
            raise ConfigError(f"all samples of {name!r} failed.")
        edge = np.full((1, *x.shape[1:]), np.inf)
        ordered = np.concatenate([-edge, x, edge])
        low, high = (binom.ppf(p, n, shares).astype(int) for p in (tail, 1 - tail))
        ends = np.stack([ordered[low], ordered[np.minimum(high + 1, n + 1)]], axis=1)
        return np.quantile(x, shares, axis=0), ends

    def indices(
        self, name: str, *, rng: np.random.Generator, resamples: int = 1000, level: float = 0.95
    ) -> "Indices":
        """Sobol indices of a number, of a study of the samples of `indices_design`.

        Samples that failed leave out those that belong to them. The intervals are of a bootstrap.

        Source:
            Saltelli et al., Comput. Phys. Comm. 181 (2010) 259, table 2: (b), and (f) of
            Jansen.

        Raises:
            ConfigError: for samples that are not of `indices_design`.
        """
        k, value = len(self.parameters), self._value(name)
        n = len(value) // (k + 2)
        X = np.stack([x.reshape(k + 2, n) if x.size == n * (k + 2) else np.zeros((k + 2, n))
                      for x in self.parameters.values()])  # fmt: skip
        swapped = [X[j, 2 + i] == X[j, int(i == j)] for i in range(k) for j in range(k)]
        if n < 2 or value.ndim > 1 or not np.all(swapped):
            where = "rom.components.studies.indices_design"
            raise ConfigError(f"indices are of a number at the samples of {where}.")
        f = value.reshape(k + 2, n)
        f = f[:, np.isfinite(f).all(axis=0)]
        chosen = rng.integers(f.shape[1], size=(resamples, f.shape[1]))
        drawn = np.array([_indices(f[:, rows]) for rows in chosen])
        ends = np.quantile(drawn, [(1 - level) / 2, (1 + level) / 2], axis=0)
        first, total = _indices(f)
        return Indices(tuple(self.parameters), first, total, ends[:, 0].T, ends[:, 1].T)

    def _value(self, name: str) -> Array:
        check_known(name, self.values, f"nothing measured is called {name!r}; there are")
        return self.values[name]


@dataclass(frozen=True, eq=False)
class Indices:
    """Shares of a variance that come from each of k parameters.

    Attributes:
        parameters: their names.
        first: (k,) from this parameter alone [1].
        total: (k,) from it and from what it does together with others [1].
        first_ends, total_ends: (k, 2) ends of their intervals [1].
    """

    parameters: tuple[str, ...]
    first: Array
    total: Array
    first_ends: Array
    total_ends: Array

    def __str__(self) -> str:
        width = max(map(len, self.parameters))
        columns = self.parameters, self.first, self.first_ends, self.total, self.total_ends
        head = f"{'':{width}}  first order              total"
        return "\n".join([head, *(
            f"{name:{width}}  {s:6.3f} ({a:6.3f} to {b:6.3f})  {t:6.3f} ({c:6.3f} to {d:6.3f})"
            for name, s, (a, b), t, (c, d) in zip(*columns, strict=True)
        )])  # fmt: skip


def _indices(f: Array) -> tuple[Array, Array]:
    """First-order and total indices of (k + 2, n) values."""
    variance = f[:2].var()
    f = f - f[:2].mean()
    first = (f[1] * (f[2:] - f[0])).mean(axis=1) / variance
    return first, 0.5 * ((f[0] - f[2:]) ** 2).mean(axis=1) / variance


@typed
def study(  # noqa: PLR0913  what runs, where, within which limits, and what is kept
    measure: Callable[..., Any] | str | Path,
    samples: Mapping[str, Any],
    *,
    keep: str | Sequence[str] = (),
    executor: Executor | None = None,
    workers: Annotated[int, Count(0)] | None = None,
    into: str | Path | None = None,
    resume: bool = False,
    time_limit: Annotated[float, NotNegative("s")] = 0.0,
    memory_limit: Annotated[float, NotNegative("1")] = 0.0,
    trust: bool = False,
    progress: bool = True,
) -> Study:
    """Measure something at many samples of its parameters, on many processes.

    The answer is the same to the bit whatever the workers and the order in which they end, as far
    as the measure is. A sample that fails is a row with its error, and the study goes on; so is one
    that ends its process.

    Args:
        measure: function of named parameters that returns named numbers or arrays, always the same
            names and shapes. It goes to other processes, so it stands in a file that can be
            imported, or in the script that runs, whose call of `study` then stands under
            ``if __name__ == "__main__"``. Or a mechanism file, whose keys are the parameters, as
            "bodies.slider.mass", "bodies.rod.damping.ratio" or "bodies.rod.mesh.lc".
        samples: {parameter: (n,) values}, numbers or texts, or a DataFrame; see
            `rom.components.studies.design`.
        keep: of the motion of a file, as "max(abs(crank pin force))"; "t" is the time.
        executor: of the standard's kind: `concurrent.futures`, ``mpi4py.futures``,
            ``dask.distributed.Client().get_executor()``; None for processes of this machine.
        workers: processes of this machine, None for one on each core, 0 for this process itself.
        into: file to which each answer is added as it comes.
        resume: go on with that file, and repeat nothing of it.
        time_limit: of a sample, by the clock [s]; 0 for none.
        memory_limit: of a worker [GiB]; 0 for none.
        trust: run what a mechanism file has in Python.
        progress: show how many are done, how fast, and the time that is left.

    Raises:
        ConfigError: for a measure that cannot be sent, keys that do not exist, samples of different
            lengths, or a file of another study.
        ResourceError: for a full disk, a file that another study writes, or a broken executor;
            what was measured is kept.
        InterruptedRun: after Ctrl-C, with a file, that goes on.
    """
    columns = _columns(samples)
    if (workers == 0 and executor is None) and (time_limit or memory_limit):
        raise ConfigError("limits are of processes of their own; leave out workers=0.")
    limits = time_limit, int(memory_limit * BYTES_PER_GIGABYTE)
    if not isinstance(measure, str | Path):
        if keep:
            raise ConfigError("keep= is of a mechanism file; a function returns what it measures.")
        return _studied(measure, columns, executor, workers, into, resume, limits, progress)
    with scratch("study") as folder:
        moved = _motion(Path(measure), keep, folder, trust)
        moved.check({name: x[0] for name, x in columns.items()})
        return _studied(moved, columns, executor, workers, into, resume, limits, progress)


def _motion(file: Path, keep: str | Sequence[str], folder: Path, trust: bool) -> "MotionOf":
    from rom.components.studies.described import MotionOf

    kept = (keep,) if isinstance(keep, str) else tuple(keep)
    if not kept:
        raise ConfigError('say what to keep, as keep="max(abs(crank pin force))".')
    return MotionOf(str(file.resolve()), kept, str(folder), trust)


def _studied(  # noqa: PLR0913
    measure: Callable[..., Any],
    columns: dict[str, list[Any]],
    executor: Executor | None,
    workers: int | None,
    into: str | Path | None,
    resume: bool,
    limits: Limits,
    progress: bool,
) -> Study:
    n = len(next(iter(columns.values())))
    payload = b"" if executor is None and workers == 0 else sent(measure, _name(measure))
    head = {"measure": _name(measure), "parameters": columns, "made with": {
        "rom": __version__, "python": platform.python_version(), "numpy": np.__version__,
    }}  # fmt: skip
    with Journal(Path(into), head, resume=resume) if into else nullcontext() as journal:
        rows = {row["sample"]: row for row in journal.rows} if journal else {}
        shapes = _shapes(rows.values())
        todo = [(k, {name: x[k] for name, x in columns.items()}) for k in range(n) if k not in rows]
        with (
            _executor(executor, workers, len(todo), b"__main__" in payload) as ready,
            _told(progress, n, len(rows)) as tell,
        ):
            alone = ready is None
            found = here(measure, todo, limits) if alone else answers(ready, payload, todo, limits)
            try:
                for number, answer in found:
                    rows[number] = row = _row(number, answer, shapes)
                    if journal:
                        journal.add(row)
                    tell("failed" in row)
            except (KeyboardInterrupt, InterruptedRun):
                if not journal:
                    raise
                said = f"interrupted; {len(rows)} of {n} samples are in {into}."
                raise InterruptedRun(said, hint="Go on with resume=True, or --resume.") from None
    made = _study(columns, rows)
    for sentence in (_said("failed", made.failed, n), _said("warned", made.warned, n)):
        warn(sentence)
    return made


def read_study(path: str | Path) -> Study:
    """What a file holds, of a study that came to its end or did not.

    Raises:
        FileFormatError: for a file that is none, or damaged; a last line that is cut is left out.
    """
    head, rows = read(path)
    return _study(head["parameters"], {row["sample"]: row for row in rows})


def _columns(samples: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Values of each parameter, as JSON has them."""
    found = {str(name): np.asarray(samples[name]) for name in samples}
    shapes = {x.shape for x in found.values()}
    if len(shapes) != 1 or len(*shapes) != 1:
        text = "samples are one list of values for each parameter, all as long"
        sizes = ", ".join(f"{name!r} {x.shape}" for name, x in found.items())
        raise ConfigError(f"{text}: {sizes}.")
    for name, x in found.items():
        endless = x.dtype.kind == "f" and not np.isfinite(x).all()
        if not x.size or x.dtype.kind not in "fiubU" or endless:
            raise ConfigError(f"values of {name!r} are finite numbers or texts, at least one.")
    return {name: x.tolist() for name, x in found.items()}


def _name(measure: Callable[..., Any]) -> str:
    kind = measure if hasattr(measure, "__qualname__") else type(measure)
    return str(getattr(measure, "name", kind.__qualname__))


@contextmanager
def _executor(
    executor: Executor | None, workers: int | None, n: int, script: bool
) -> Iterator[Any]:
    """What measures, None for this process."""
    if executor is not None or workers == 0 or not n:
        yield executor
        return
    with processes(min(workers or len(os.sched_getaffinity(0)), n), script=script) as pool:
        yield pool


@contextmanager
def _told(progress: bool, n: int, begun: int) -> Iterator[Callable[[bool], None]]:
    """Around samples, some of which are there; gives what is called behind each other one."""
    done, failed, clock = begun, 0, perf_counter()
    bar = Progress(n) if progress and looked_for() else None

    def tell(bad: bool) -> None:
        nonlocal done, failed
        done, failed = done + 1, failed + bad
        if bar:
            rate = (done - begun) / (perf_counter() - clock)
            left = f"{rate:.3g} a second, {(n - done) / rate:.0f} s left"
            bar.reach(done, f"{done} of {n} samples, {left}" + f", {failed} failed" * bool(failed))

    try:
        yield tell
    finally:
        if bar:
            bar.end()


def _shapes(rows: Any) -> dict[str, tuple[int, ...]]:
    """Names and shapes of what the first row that did not fail holds."""
    good: dict[str, Any] = next((row["values"] for row in rows if "values" in row), {})
    return {name: unpacked(value).shape for name, value in good.items()}


def _row(number: int, answer: Answer, shapes: dict[str, tuple[int, ...]]) -> Row:
    """The row of an answer; one of other names or shapes than the first failed."""
    kind, found, said, seconds = answer
    if kind == "refused":
        raise ConfigError(said)
    if kind == "values":
        own = {name: x.shape for name, x in found.items()}
        shapes.update({} if shapes else own)
        if own == shapes:
            values = {name: packed(x) for name, x in found.items()}
            more = {"warned": said} if said else {}
            return {"sample": number, "seconds": seconds, "values": values} | more
        found, said = "ConfigError", f"it returned {own}, others {shapes}"
    return {"sample": number, "seconds": seconds, "failed": f"{found}: {said}"}


def _study(columns: Mapping[str, list[Any]], rows: Mapping[int, Row]) -> Study:
    n = len(next(iter(columns.values())))
    first = min((k for k, row in rows.items() if "values" in row), default=None)
    shapes = {} if first is None else _shapes([rows[first]])
    values = {name: np.full((n, *shape), np.nan) for name, shape in shapes.items()}
    every = {k: rows.get(k, {"failed": "it was not reached", "seconds": 0.0}) for k in range(n)}
    for k, row in every.items():
        for name, value in row.get("values", {}).items():
            values[name][k] = unpacked(value)
    failed, warned = (
        {k: row[what] for k, row in every.items() if what in row} for what in ("failed", "warned")
    )
    parameters = {name: np.array(x) for name, x in columns.items()}
    seconds = np.array([row["seconds"] for row in every.values()], dtype=float)
    return Study(parameters, values, failed, warned, seconds)


def _said(what: str, told: Mapping[int, object], n: int) -> str:
    """A sentence on the samples that failed or warned, if any did."""
    if not told:
        return ""
    some = "; ".join(f"sample {k}: {text!s:.200}" for k, text in list(told.items())[:MOST_TOLD])
    return f"{len(told)} of {n} samples {what} ({len(told) / n:.0%}): {some}."
