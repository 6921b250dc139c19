"""Samples on executors: `concurrent.futures` of the standard, MPI, Dask, or processes of our own.

The measure goes over once to each worker, which says when it does not know it yet. Of processes of
our own one that dies takes the others of its pool down; the samples under way are then repeated
one by one, until the one that ends its process is found.
"""

import multiprocessing  # noqa: TID251  of which the pool of the standard is made
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from concurrent.futures.process import ProcessPoolExecutor
from contextlib import contextmanager
from hashlib import sha256
from typing import Any

from rom.components.studies import worker
from rom.components.studies.worker import Answer
from rom.errors import ConfigError, ResourceError

AT_ONCE = 64  # samples handed to an executor that does not say how many workers it has
PER_WORKER = 2  # samples handed to a worker at once, so that it need not wait
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
KILLED = "its process was ended, by the system for lack of memory, say, or by a library"
NO_MAIN = (
    "Workers run the script that starts them, up to what stands under "
    "if __name__ == '__main__': put the call of rom.study there."
)
Given = tuple[int, dict[str, Any]]  # number and parameters of a sample
Limits = tuple[float, int]  # of a sample [s] and of a worker [bytes]; 0 for none


class Processes:
    """A pool of processes, spawned, each with one thread of BLAS, that can be replaced."""

    def __init__(self, workers: int):
        self.workers = workers
        self.pool = self._started()
        try:
            self.pool.submit(worker.ready).result()
        except BrokenExecutor as error:
            raise ConfigError("the workers of the study do not start.", hint=NO_MAIN) from error

    def _started(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self.workers, context, worker.begin, (os.getpid(),))

    def submit(self, *task: Any) -> "Future[Any]":
        """As of an executor."""
        return self.pool.submit(*task)

    def replace(self) -> None:
        """Begin with new processes."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        self.pool = self._started()

    def end(self, *, now: bool) -> None:
        """Wait for the processes, or end them where they are."""
        for process in list((self.pool._processes or {}).values()) if now else ():
            process.kill()  # ProcessPoolExecutor itself can only wait, up to Python 3.13
        self.pool.shutdown(cancel_futures=True)


@contextmanager
def processes(workers: int) -> Iterator[Processes]:
    """So many processes, ended behind it."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    pool, whole = None, False
    try:
        pool = Processes(workers)
        yield pool
        whole = True
    finally:
        if pool is not None:
            pool.end(now=not whole)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def answers(
    executor: Executor | Processes, payload: bytes, samples: list[Given], limits: Limits
) -> Iterator[tuple[int, Answer]]:
    """What the workers say of each sample, as it comes."""
    key, known = sha256(payload).hexdigest(), getattr(executor, "workers", None)
    known = known or getattr(executor, "_max_workers", None)
    most = PER_WORKER * known if isinstance(known, int) else AT_ONCE
    waiting, suspects, running = deque(samples), deque[Given](), dict["Future[Any]", Given]()

    def begin(sample: Given, sent: bytes | None = None) -> None:
        future = executor.submit(worker.measured, key, sent, sample[1], *limits)
        running[future] = sample

    while waiting or suspects or running:
        source, at_once = (suspects, 1) if suspects else (waiting, most)
        while source and len(running) < at_once:
            begin(source.popleft())
        lost = list[Given]()
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            sample = running.pop(future)
            try:
                answer = future.result()
            except BrokenExecutor as error:
                if not isinstance(executor, Processes):
                    text = f"the executor broke: {error}."
                    raise ResourceError(text, hint="Go on with resume=True.") from error
                lost.append(sample)
            except Exception as error:  # of an executor that gives a worker up, as Dask's
                yield sample[0], ("failed", type(error).__name__, str(error), 0.0)
            else:
                if isinstance(answer, str):
                    begin(sample, payload)
                else:
                    yield sample[0], answer
        if lost and isinstance(executor, Processes):
            lost += running.values()
            running.clear()
            executor.replace()
            if len(lost) == 1:
                yield lost[0][0], ("failed", "Killed", KILLED, 0.0)
            else:
                suspects.extend(lost)


def here(
    measure: Callable[..., Any], samples: list[Given], limits: Limits
) -> Iterator[tuple[int, Answer]]:
    """The same in this process, one after the other."""
    worker.know("here", measure)
    for number, given in samples:
        answer = worker.measured("here", None, given, *limits)
        assert not isinstance(answer, str)
        yield number, answer
