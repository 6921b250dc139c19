"""What a second process can gain on this machine: products of matrices, and copies, per second.

Two processors of a cloud are often two threads of one core: what they do together is then hardly
more than what one does alone, whatever the program.

``python -m benchmarks.peers.machine`` prints {work: how often one process does it in a second}.
"""

import json
import sys
from time import perf_counter

import numpy as np

MATRIX_SIZE = 600  # as wide as the larger fronts of a factor; 3 MB
COPY_SIZE = 20_000_000  # numbers, beyond all caches
LEAST_SECONDS = 1.0
WORKS = ("products of matrices", "copies")


def rate(work: str) -> float:
    """How often this process does the work in a second."""
    A = np.ones((MATRIX_SIZE, MATRIX_SIZE))
    B = np.ones(COPY_SIZE if work == "copies" else 1)
    C, AA = np.ones_like(B), np.ones_like(A)
    start, n = perf_counter(), 0
    while perf_counter() - start < LEAST_SECONDS:
        np.copyto(C, B) if work == "copies" else np.matmul(A, A, out=AA)
        n += 1
    return n / (perf_counter() - start)


if __name__ == "__main__":
    sys.stdout.write(json.dumps({work: rate(work) for work in WORKS}) + "\n")
