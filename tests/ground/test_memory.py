"""What a process may still take: the least of all limits; and what is said when it runs out."""

import numpy as np
import pytest

from rom.cli.main import translated
from rom.errors import ResourceError
from rom.process import memory


@pytest.mark.parametrize(("limit", "use", "cache"), memory.GROUP_FILES)
def test_a_control_group_of_either_version_leaves_its_rest(tmp_path, limit, use, cache):
    assert memory.group_bytes(tmp_path / "none") == memory.NO_LIMIT
    (tmp_path / limit).write_text("1000000\n")
    (tmp_path / use).write_text("900000\n")
    (tmp_path / "memory.stat").write_text(f"anon 500000\n{cache} 400000\n")
    assert memory.group_bytes(tmp_path) == 500_000.0
    (tmp_path / limit).write_text("max\n")
    assert memory.group_bytes(tmp_path) == memory.NO_LIMIT


def test_the_least_limit_counts(monkeypatch):
    monkeypatch.setattr(
        memory.resource, "getrlimit", lambda _: (int(memory.machine_free_bytes()), 0)
    )
    assert memory.free_bytes() < memory.machine_free_bytes()
    monkeypatch.setattr(memory, "address_bytes", lambda: 9.0)
    monkeypatch.setattr(memory, "group_bytes", lambda _: 7.0)
    assert memory.free_bytes() == 7.0


def test_running_out_says_what_was_asked_and_what_there_is(monkeypatch):
    with pytest.raises(MemoryError) as caught:
        np.empty((2**30, 2**22))  # 2^52 numbers: 32 PiB
    monkeypatch.setattr(memory, "group_bytes", lambda _: 2.0**30)
    monkeypatch.setattr(memory, "machine_free_bytes", lambda: 2.0**33)
    error = translated(caught.value)
    assert isinstance(error, ResourceError)
    assert "for 3.36e+07 GiB, 1073741824 x 4194304 numbers" in error.message
    assert "may take 1 GiB more" in error.message
    assert "memory ran out; this process may take" in translated(MemoryError()).message
