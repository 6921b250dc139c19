"""Compiled kernels: dropped when a source of theirs changes, and what they leave out."""

import numpy as np
from numba import njit

from rom.mbs.kernels import compiled
from rom.mbs.kernels.compiled import drop_stale_cache


def test_only_sources_of_kernels_drop_them(tmp_path):
    kernels, plain = tmp_path / "motion.py", tmp_path / "mechanism.py"
    kernels.write_text("from rom.mbs.kernels.compiled import kernel\n")
    plain.write_text("text = 1\n")
    stamp, code = tmp_path / "cache" / "stamp", tmp_path / "cache" / "motion.advance-1.py311.nbi"
    assert drop_stale_cache(tmp_path, stamp)
    code.write_text("machine code")
    assert not drop_stale_cache(tmp_path, stamp)
    plain.write_text("text = 2\n")
    assert not drop_stale_cache(tmp_path, stamp) and code.exists()
    layout = tmp_path / "kernels" / "layout.py"
    layout.parent.mkdir()
    for source, text in (
        (kernels, "from rom.mbs.kernels.compiled import inner\n"),
        (layout, "SIZE = 3\n"),
    ):
        code.write_text("machine code")
        source.write_text(text)
        assert drop_stale_cache(tmp_path, stamp) and not code.exists()


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
