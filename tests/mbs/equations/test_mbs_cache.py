"""Compiled kernels: dropped when a source of theirs changes, and what they leave out."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from numba import njit

from cases.command import environment
from cases.paths import ROOT
from rom.mbs.kernels import compiled

OUTER = """
from rom.toy.inner import SIZE, inside
from rom.mbs.kernels.compiled import kernel
{more}
@kernel
def outer(x):
    return SIZE * inside(x)

if __name__ == "__main__":
    from rom.toy import outer as built
    print(built.outer(1.0), sum(built.outer.stats.cache_hits.values()))
"""
INNER = """
from rom.mbs.kernels.compiled import inner
from rom.toy.plain import UNITS
SIZE = {size}

@inner
def inside(x):
    return x + {added}
"""


@pytest.mark.parametrize("elsewhere", [True, False])
def test_no_kernel_runs_that_was_made_of_other_sources(elsewhere, tmp_path):
    """A constant and a function built in from another file; a file without kernels is no source."""
    package = tmp_path / "rom"
    shutil.copytree(ROOT / "rom", package, ignore=shutil.ignore_patterns("__pycache__"))
    toy = package / "toy"
    toy.mkdir()
    (toy / "__init__.py").touch()
    env = environment(PYTHONPATH=str(tmp_path))
    env["NUMBA_CACHE_DIR"] = str(tmp_path / "cache") if elsewhere else ""

    def answer(size, added, more="", units=1):
        (toy / "plain.py").write_text(f"UNITS = {units}")
        (toy / "inner.py").write_text(INNER.format(size=size, added=added))
        (toy / "outer.py").write_text(OUTER.format(more=more))
        done = subprocess.run([sys.executable, "-m", "rom.toy.outer"], env=env, cwd=tmp_path,
                              capture_output=True, text=True, check=True)  # fmt: skip
        return done.stdout.split()

    assert answer(2, 1) == ["4.0", "0"]
    assert answer(2, 1) == ["4.0", "1"]
    assert answer(2, 1, units=5) == ["4.0", "1"]
    assert answer(3, 1) == ["6.0", "0"]
    assert answer(3, 2) == ["9.0", "0"]
    assert answer(3, 2, more="# text") == ["9.0", "0"]


def test_kernels_copy_arrays_and_count_no_references():
    """Counting takes longer than the mechanics: every part of every argument, in every call."""
    options = compiled.OPTIONS | {"cache": False}

    @njit(**options)
    def spread(x, out, k):
        compiled.copy(x[k], out[k])
        return x[k, 0].sum()

    x, out = np.random.default_rng(2).normal(size=(3, 4, 5)), np.zeros((3, 4, 5))
    total = spread(x, out, 1)
    np.testing.assert_array_equal(out, x * np.array([0.0, 1.0, 0.0])[:, None, None])
    np.testing.assert_allclose(total, x[1, 0].sum(), rtol=1e-14)
    code = next(iter(spread.inspect_llvm().values()))
    assert code.count("call void @NRT_") == 0
