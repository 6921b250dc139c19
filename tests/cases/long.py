"""What is left to `make long`, which sets ROM_LONG=1, and what of `make test` takes longest."""

import os

ROM_LONG = bool(os.environ.get("ROM_LONG"))
# numbers of processes whose results are compared with those of one
SHARED_BY = (2, 3) if ROM_LONG else (3,)
# files of `make test` that begin, so that no worker is left alone with one of them at the end
LONGEST_FIRST = (
    "project/test_demos.py",
    "faults/test_generated.py",
)
