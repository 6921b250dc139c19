"""Compiled kernels are dropped when a source of theirs changes, and only then."""

from rom.mbs.compiled import drop_stale_cache


def test_only_sources_of_kernels_drop_them(tmp_path):
    kernels, plain = tmp_path / "motion.py", tmp_path / "mechanism.py"
    kernels.write_text("from rom.mbs.compiled import kernel\n")
    plain.write_text("text = 1\n")
    stamp, code = tmp_path / "cache" / "stamp", tmp_path / "cache" / "motion.advance-1.py311.nbi"
    assert drop_stale_cache(tmp_path, stamp)
    code.write_text("machine code")
    assert not drop_stale_cache(tmp_path, stamp)
    plain.write_text("text = 2\n")
    assert not drop_stale_cache(tmp_path, stamp) and code.exists()
    for source in (kernels, tmp_path / "arrays.py"):
        code.write_text("machine code")
        source.write_text("from rom.mbs.compiled import inner\n")
        assert drop_stale_cache(tmp_path, stamp) and not code.exists()
