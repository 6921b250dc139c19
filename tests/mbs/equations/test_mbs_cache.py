"""Compiled kernels: dropped when a source of theirs changes, and what they leave out."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit

from cases.command import environment, python
from cases.long import few
from cases.paths import ROOT
from rom.mbs.compiler import cache
from rom.mbs.compiler.cache import CodeFiles
from rom.mbs.kernels import compiled, stages

PLACES = ("own folder", "of the user", "nowhere")
ELSEWHERE = [pytest.param(place, marks=pytest.mark.once) for place in PLACES]
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
from rom.toy import scales as of, words
from rom.toy.words import told
SIZE = {size}

@inner
def inside(x):
    return (x + {added} * UNITS) * of.SCALE_1
"""


def place_for_code(where, tmp_path, toy):
    """Variables by which Numba keeps code there; a file where a folder would be is not writable."""
    if where == "own folder":
        return {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    if where != "beside":
        (toy / "__pycache__").touch()
    home = tmp_path / "home"
    if where == "nowhere":
        home.touch()
    return {"NUMBA_CACHE_DIR": "", "HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")}


@pytest.mark.parametrize("where", few(1, ["beside", *ELSEWHERE]))
def test_no_kernel_runs_that_was_made_of_other_sources(where, tmp_path):
    """Constants and a function built in from other files; a file that gives none is no source."""
    package = tmp_path / "rom"
    shutil.copytree(ROOT / "rom", package, ignore=shutil.ignore_patterns("*.nb?"))
    toy = package / "toy"
    toy.mkdir()
    (toy / "__init__.py").touch()
    # Python itself takes two texts of one length within a second for one
    env = environment(PYTHONPATH=str(tmp_path), PYTHONDONTWRITEBYTECODE="1")
    env |= place_for_code(where, tmp_path, toy)
    kept = "0" if where == "nowhere" else "1"

    def answer(size, added, more="", units=1, told=1, scale=1):
        (toy / "plain.py").write_text(f"UNITS = {units}")
        (toy / "scales.py").write_text(f"SCALE_1 = {scale}")
        (toy / "words.py").write_text(f"told = {told}")
        (toy / "inner.py").write_text(INNER.format(size=size, added=added))
        (toy / "outer.py").write_text(OUTER.format(more=more))
        done = python("-m", "rom.toy.outer", env=env, cwd=tmp_path, check=True)
        return done.stdout.split()

    assert answer(2, 1) == ["4.0", "0"]
    assert answer(2, 1) == ["4.0", kept]
    assert answer(2, 1, told=5) == ["4.0", kept]
    assert answer(2, 1, scale=3) == ["12.0", "0"]
    assert answer(2, 1, units=5) == ["12.0", "0"]
    assert answer(3, 1) == ["6.0", "0"]
    assert answer(3, 2) == ["9.0", "0"]
    assert answer(3, 2, more="# text") == ["9.0", "0"]
    folder = {"beside": toy, "own folder": tmp_path / "cache", "of the user": tmp_path / "home"}
    if where in folder:  # nothing of earlier sources is left
        assert len(list(folder[where].rglob("outer.outer*.nbc"))) == 1


SLOW = """
from rom.process import patience
patience.SHORT_WAIT = 1e-3
from rom.mbs.kernels.compiled import inner, kernel

@inner
def first(x):
    return x + 1

@inner
def second(x):
    return x + 2

@kernel
def outer(x):
    return first(x) * second(x)

@kernel
def later(x):
    return second(x)

if __name__ == "__main__":
    import logging, sys
    logging.getLogger("rom").setLevel(sys.argv[1])
    import slow
    assert slow.outer(1.0) == 6.0
    assert slow.later(1.0) == 3.0
"""


@pytest.mark.parametrize(
    ("level", "rank", "said"), few(1, [("INFO", "0", 1), ("ERROR", "0", 0), ("INFO", "1", 0)])
)
def test_who_waits_for_the_compiler_is_told_once(tmp_path, level, rank, said):
    """From Python, without any option; then nothing is left to wait for."""
    (tmp_path / "slow.py").write_text(SLOW)
    env = environment(OMPI_COMM_WORLD_RANK=rank, OMPI_COMM_WORLD_SIZE="2")
    for expected in (said, 0):
        done = python(tmp_path / "slow.py", level, env=env, check=True)
        lines = done.stderr.splitlines()
        assert len(lines) == expected, lines
        assert all(" takes about 5 s more, this once: the code is kept in " in x for x in lines)
        assert all(str(tmp_path / "__pycache__") in line for line in lines)


def called(x):
    """As a kernel that another one calls."""
    return x


def calling(x):
    """As a kernel that is waited for."""
    return CALLED_KERNEL(x) + 1


CALLED_KERNEL = SimpleNamespace(py_func=called)


@pytest.mark.parametrize("kept", [False, True])
def test_the_rest_is_what_is_expected_with_all_it_calls_but_for_what_is_kept(monkeypatch, kept):
    files = {
        calling: SimpleNamespace(full=lambda: False),
        called: SimpleNamespace(full=lambda: kept),
    }
    monkeypatch.setattr(cache, "CODE_FILES", files)
    monkeypatch.setattr(cache, "EXPECTED_FUNCTIONS", {calling})
    sizes = [len(function.__code__.co_code) for function in (calling, called)]
    assert cache._size_of_rest() == (sizes[0] if kept else sum(sizes))
    del files[called]  # taken in wherever it is called, and never kept by itself
    assert cache._size_of_rest() == sum(sizes)


def test_who_can_keep_nothing_is_told_so(tmp_path):
    (tmp_path / "slow.py").write_text(SLOW)
    env = environment(**place_for_code("nowhere", tmp_path, tmp_path))
    for _ in range(2):
        done = python(tmp_path / "slow.py", "INFO", env=env, check=True)
        assert " s more, in each run, as no folder can be written: set NUMBA_CACHE" in done.stderr


@pytest.mark.parametrize("busy", [[], [0], [0, 1], [2]])
def test_stages_that_another_process_compiles_are_asked_for_last(monkeypatch, busy):
    """So that two processes share the work; all are linked in the end."""
    linked, kernels, files = [], {}, {}
    for k in range(3):
        function = SimpleNamespace(py_func=k)
        files[k] = SimpleNamespace(made_elsewhere=lambda k=k: k in busy)
        link = {"kernel": function, "needed": bool, "link": lambda k=k: linked.append(k)}
        kernels[k] = SimpleNamespace(linked=False, asked=str, **link)
    none = {"kernel": None, "linked": False}
    kernels[3] = SimpleNamespace(**none, asked=str, needed=lambda system: not system)
    kernels[4] = SimpleNamespace(**none, asked=int, needed=bool)
    monkeypatch.setattr(stages, "STAGE_KERNELS", kernels)
    monkeypatch.setattr(stages, "CODE_FILES", files)
    monkeypatch.setattr(stages, "EXPECTED_FUNCTIONS", set())
    stages.link("a system")
    assert linked == [k for k in range(3) if k not in busy] + busy
    assert stages.EXPECTED_FUNCTIONS == {0, 1, 2}


def files_of(tmp_path, sources):
    """Where code of one function is kept, made of some sources."""
    cache = SimpleNamespace(_impl=SimpleNamespace(filename_base="f"), _cache_path=str(tmp_path))
    files = CodeFiles(cache, files_of)
    files._version = files._source_stamp = sources
    return files


@pytest.mark.parametrize("last", ["_save_data", "_save_index"])
def test_a_reader_never_finds_code_of_older_sources_under_a_new_index(tmp_path, monkeypatch, last):
    """Whichever of the two files a process has written when it is killed, or looked at."""
    files_of(tmp_path, "old").save("key", "old code")
    new = files_of(tmp_path, "new")
    write = getattr(new, last)

    def killed(*what):
        write(*what)
        raise KeyboardInterrupt

    monkeypatch.setattr(new, last, killed)
    with pytest.raises(KeyboardInterrupt):
        new.save("key", "new code")
    named = files_of(tmp_path, "new")._load_index().values()
    assert all((tmp_path / name).exists() for name in named)
    assert files_of(tmp_path, "new").load("key") in (None, "new code")
    assert files_of(tmp_path, "old").load("key") in (None, "old code")


def writes(files, key, monkeypatch):
    """What one who has read an empty index writes: calls and their arguments, in their order."""
    planned = []
    monkeypatch.setattr(files, "_load_index", dict)
    for part in ("_save_data", "_save_index"):
        write = getattr(files, part)
        monkeypatch.setattr(files, part, lambda *what, write=write: planned.append((write, what)))
    files.save(key, f"code of {key}")
    return planned


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (0, 2, 1, 3), (0, 2, 3, 1)])
def test_two_writers_without_locks_never_mix_their_code(tmp_path, monkeypatch, order):
    planned = [w for key in "ab" for w in writes(files_of(tmp_path, "same"), key, monkeypatch)]
    for write, what in (planned[k] for k in order):
        write(*what)
    found = {key: files_of(tmp_path, "same").load(key) for key in "ab"}
    assert all(found[key] in (None, f"code of {key}") for key in "ab")
    assert any(found.values())


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


def test_functions_that_only_kernels_call_are_part_of_them_with_their_errors():
    """They have no machine code of their own: Numba keeps none, and links what each one calls."""

    @compiled.inner
    def root(x):
        if x < 0.0:
            raise ValueError("no root of what is below zero")
        return x**0.5

    @compiled.inner
    def distance(x, y):
        return root(x * x + y * y) - root(x)

    @njit(**compiled.OPTIONS | {"cache": False})
    def both(x, y):
        return distance(x, y) + root(x)

    assert both(9.0, 12.0) == 15.0
    with pytest.raises(ValueError, match="no root of what is below zero"):
        both(-1.0, 1.0)
    assert not any(
        cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name)
        for function in (root, distance)
        for cres in function.overloads.values()
    )
