"""Samples on executors: `concurrent.futures` of the standard, MPI, Dask, or processes of our own.

The measure goes over once to each worker, which says when it does not know it yet. Of processes of
our own one that dies takes the others of its pool down; the samples under way are then repeated
one by one, until the one that ends its process is found.
"""

import multiprocessing  # noqa: TID251  of which the pool of the standard is made
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator
from concurrent import futures
from concurrent.futures import BrokenExecutor, Executor, Future
from concurrent.futures.process import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from types import ModuleType
from typing import Any
from unittest.mock import patch

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

    def __init__(self, workers: int, *, script: bool):
        self.workers, self.script = workers, script
        self.pool = self._started()
        try:
            self.pool.submit(worker.ready).result()
        except BrokenExecutor as error:
            raise ConfigError("the workers of the study do not start.", hint=NO_MAIN) from error

    def _started(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(self.workers, context, worker.begin, (os.getpid(),))
        # workers run the script that starts them again, unless there is none to be seen
        hidden = {} if self.script else {"__main__": ModuleType("__main__")}
        with patch.dict(sys.modules, hidden):
            for _ in range(self.workers):  # each starts one
                pool.submit(worker.ready)
        return pool

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
def processes(workers: int, *, script: bool) -> Iterator[Processes]:
    """So many processes, ended behind it; with what the script that runs defines, if need be."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    pool, whole = None, False
    try:
        pool = Processes(workers, script=script)
        yield pool
        whole = True
    finally:
        if pool is not None:
            pool.end(now=not whole)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


@dataclass
class Handing:
    """Samples that wait, that run, and those one of which has ended its process."""

    executor: Executor | Processes
    payload: bytes
    limits: Limits
    waiting: deque[Given]
    suspects: deque[Given] = field(default_factory=deque)
    running: dict["Future[Any]", Given] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.key = sha256(self.payload).hexdigest()
        known = getattr(self.executor, "workers", getattr(self.executor, "_max_workers", None))
        self.most = PER_WORKER * known if isinstance(known, int) else AT_ONCE

    def begin(self, sample: Given, sent: bytes | None = None) -> bool:
        """Whether it could be handed over, which a pool of our own that broke cannot take."""
        submit, task = self.executor.submit, (self.key, sent, sample[1], *self.limits)
        try:
            self.running[submit(worker.measured, *task)] = sample
        except Exception as error:  # of whatever kind executors raise that have ended
            if isinstance(self.executor, Processes) and isinstance(error, BrokenExecutor):
                return False
            raise _broke(error) from error
        return True

    def fill(self) -> None:
        """Hand over what there is room for, suspects one by one."""
        source, most = (self.suspects, 1) if self.suspects else (self.waiting, self.most)
        while source and len(self.running) < most and self.begin(source[0]):
            source.popleft()

    def taken(self, future: "Future[Any]") -> Answer | str | None:
        """What came of a sample; None where its pool broke."""
        try:
            answer: Answer | str = future.result()
        except (BrokenExecutor, futures.CancelledError, OSError) as error:
            if not isinstance(self.executor, Processes):
                raise _broke(error) from error
            return None
        except Exception as error:  # of an executor that gives a worker up, as Dask's
            return ("failed", type(error).__name__, str(error), 0.0)
        return answer

    def repeat(self, lost: list[Given], pool: Processes) -> Iterator[tuple[int, Answer]]:
        """Begin with a new pool; a sample that was alone in the one that broke has failed."""
        lost += self.running.values()
        self.running.clear()
        pool.replace()
        if len(lost) == 1:
            yield lost[0][0], ("failed", "Killed", KILLED, 0.0)
        else:
            self.suspects.extend(lost)


def answers(
    executor: Executor | Processes, payload: bytes, samples: list[Given], limits: Limits
) -> Iterator[tuple[int, Answer]]:
    """What the workers say of each sample, as it comes."""
    hand = Handing(executor, payload, limits, deque(samples))
    while hand.waiting or hand.suspects or hand.running:
        hand.fill()
        if isinstance(executor, Processes) and not hand.running:
            executor.replace()  # it broke while it had nothing to do
        lost = list[Given]()
        for future in futures.wait(hand.running, return_when=futures.FIRST_COMPLETED).done:
            sample, answer = hand.running.pop(future), hand.taken(future)
            if answer is None:
                lost.append(sample)
            elif not isinstance(answer, str):
                yield sample[0], answer
            elif not hand.begin(sample, payload):
                hand.waiting.append(sample)
        if isinstance(executor, Processes) and lost:
            yield from hand.repeat(lost, executor)


def _broke(error: Exception) -> ResourceError:
    text = f"the executor broke: {type(error).__name__}: {error}".rstrip(": ")
    return ResourceError(f"{text}.", hint="Go on with resume=True.")


def here(
    measure: Callable[..., Any], samples: list[Given], limits: Limits
) -> Iterator[tuple[int, Answer]]:
    """The same in this process, one after the other."""
    worker.know("here", measure)
    for number, given in samples:
        answer = worker.measured("here", None, given, *limits)
        assert not isinstance(answer, str)
        yield number, answer
